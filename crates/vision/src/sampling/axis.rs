use multiversion::multiversion;

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
        self.index.resize(outputs * self.taps, 0);
        self.weight.resize(outputs * self.taps, 0.0);
        let line = Line { center, step, half_width, outputs, len };
        (self.first, self.end) = fill(&line, self.taps, &mut self.index, &mut self.weight);
        let first = self.first as u32;
        self.index.iter_mut().for_each(|i| *i -= first);
    }
}

/// What an axis is made for.
struct Line {
    center: f64,
    step: f64,
    half_width: f64,
    outputs: usize,
    len: usize,
}

/// Writes source positions and weights, `taps` for each output; returns the first position used and one past the last.
#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn fill(line: &Line, taps: usize, index: &mut [u32], weight: &mut [f32]) -> (usize, usize) {
    let &Line { center, step, half_width, outputs, len } = line;
    // 1 unless the kernel is wider than MAX_TAPS.
    let spacing = (2.0 * half_width / taps as f64).max(1.0);
    let (mut first, mut end) = (len, 0);
    for (j, (indices, weights)) in index.chunks_exact_mut(taps).zip(weight.chunks_exact_mut(taps)).enumerate() {
        let position = center + (j as f64 + 0.5 - outputs as f64 / 2.0) * step - 0.5;
        let start = (position - half_width).floor() + 1.0;
        let mut sum = 0.0;
        for (k, (index, weight)) in indices.iter_mut().zip(weights.iter_mut()).enumerate() {
            let source = (start + k as f64 * spacing).floor();
            *weight = (1.0 - (source - position).abs() / half_width).max(0.0) as f32;
            // A cast from float saturates, so even wild positions end inside.
            let at = (source as isize).clamp(0, len as isize - 1) as usize;
            (first, end) = (first.min(at), end.max(at + 1));
            sum += *weight;
            *index = at as u32;
        }
        if sum > 0.0 {
            weights.iter_mut().for_each(|w| *w /= sum);
        } else if let Some(only) = weights.first_mut() {
            *only = 1.0;
        }
    }
    (first.min(end), end)
}
