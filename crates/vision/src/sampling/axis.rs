/// The widest kernel: beyond a shrinking by half of this, source pixels are skipped.
const MAX_TAPS: usize = 16;

/// How one axis of a patch is interpolated: for every output a fixed number of source pixels and their weights.
///
/// A triangle kernel of half-width `max(step, 1)`: bilinear interpolation when enlarging, an antialiased mean when shrinking.
#[derive(Debug, Clone, Default)]
pub(super) struct Axis {
    /// Taps per output.
    pub(super) taps: usize,
    /// Source positions, clamped into the image, relative to `first`; `taps` for each output.
    pub(super) index: Vec<u32>,
    /// Weights, summing to 1 for each output.
    pub(super) weight: Vec<f32>,
    /// First source position used.
    pub(super) first: usize,
    /// One past the last source position used.
    pub(super) end: usize,
}

impl Axis {
    /// Makes room for the widest kernel, so that [`build`](Self::build) never allocates for up to `outputs` outputs.
    pub(super) fn reserve(&mut self, outputs: usize) {
        let want = outputs * MAX_TAPS;
        self.index.reserve(want.saturating_sub(self.index.len()));
        self.weight.reserve(want.saturating_sub(self.weight.len()));
    }

    /// Fills the tables for `outputs` outputs, `step` source pixels apart, centred at `center` of a line of `len` pixels.
    pub(super) fn build(&mut self, center: f64, step: f64, outputs: usize, len: usize) {
        let half_width = step.max(1.0);
        self.taps = ((2.0 * half_width).ceil() as usize).clamp(2, MAX_TAPS);
        // 1 unless the kernel is wider than MAX_TAPS.
        let spacing = (2.0 * half_width / self.taps as f64).max(1.0);
        self.index.clear();
        self.weight.clear();
        let (mut first, mut end) = (len, 0);
        for j in 0..outputs {
            let position = center + (j as f64 + 0.5 - outputs as f64 / 2.0) * step - 0.5;
            let start = (position - half_width).floor() + 1.0;
            let at = self.weight.len();
            let mut sum = 0.0;
            for k in 0..self.taps {
                let source = (start + k as f64 * spacing).floor();
                let weight = (1.0 - (source - position).abs() / half_width).max(0.0) as f32;
                // A cast from float saturates, so even wild positions end inside.
                let index = (source as isize).clamp(0, len as isize - 1) as usize;
                (first, end) = (first.min(index), end.max(index + 1));
                sum += weight;
                self.index.push(index as u32);
                self.weight.push(weight);
            }
            if sum > 0.0 {
                self.weight[at..].iter_mut().for_each(|w| *w /= sum);
            } else {
                self.weight[at] = 1.0;
            }
        }
        (self.first, self.end) = (first.min(end), end);
        let first = self.first as u32;
        self.index.iter_mut().for_each(|i| *i -= first);
    }
}
