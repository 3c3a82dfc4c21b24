use crate::correlation::ScaleFilterParams;
use multiversion::multiversion;
use pursuit_geometry::{BBox, Size};
use pursuit_imaging::Frame;
use pursuit_vision::fourier::{HannEnds, hann};
use pursuit_vision::hog::{Hog, HogLayout};
use pursuit_vision::sampling::{Planes, Sampler, Window};
use std::f64::consts::TAU;

/// Samples of the target at all sizes and their spectra along scale; scratch, not state.
#[derive(Debug, Clone)]
pub(super) struct Samples {
    hog: Hog,
    sampler: Sampler,
    patch: Planes,
    planes: Planes,
    /// Size factor and Hann weight of each sample.
    sizes: Vec<(f64, f32)>,
    /// `cos` and `−sin` of all multiples of one turn divided by the number of samples.
    turns: Vec<(f32, f32)>,
    values: Vec<f32>,
    /// For each frequency, the real parts of all features, then the imaginary parts.
    spectrum: Vec<f32>,
    features: usize,
}

impl Samples {
    pub(super) fn new(settings: &ScaleFilterParams, patch: Size) -> Self {
        let hog = Hog::new(HogLayout::Felzenszwalb31, settings.cell_px);
        let (features, count) = (hog.grid(patch).area() * hog.channels(), settings.scales);
        let turn = |i: usize| TAU * i as f64 / count as f64;
        Self {
            hog,
            sampler: Sampler::new(),
            patch: Planes::default(),
            planes: Planes::default(),
            sizes: (0..count).map(|i| settings.factor(i as f64)).zip(hann(count, HannEnds::Positive)).collect(),
            turns: (0..count).map(|i| (turn(i).cos() as f32, -turn(i).sin() as f32)).collect(),
            values: vec![0.0; count * features],
            spectrum: vec![0.0; settings.frequencies() * 2 * features],
            features,
        }
    }

    pub(super) const fn features(&self) -> usize {
        self.features
    }

    /// Samples `bbox` at all sizes and transforms every feature along scale.
    pub(super) fn take(&mut self, frame: &Frame, bbox: &BBox, patch: Size) {
        let count = self.sizes.len();
        for (&(factor, weight), out) in self.sizes.iter().zip(self.values.chunks_exact_mut(self.features)) {
            let window = Window::of_region(bbox.scaled(factor), patch);
            self.sampler.gray(frame.gray(), &window, &mut self.patch);
            self.hog.extract(&self.patch, &mut self.planes);
            out.iter_mut().zip(self.planes.as_slice()).for_each(|(out, v)| *out = weight * v);
        }
        for (k, bin) in self.spectrum.chunks_exact_mut(2 * self.features).enumerate() {
            let (re, im) = bin.split_at_mut(self.features);
            re.fill(0.0);
            im.fill(0.0);
            for (i, sample) in self.values.chunks_exact(self.features).enumerate() {
                add_turned(re, im, sample, self.turns[k * i % count]);
            }
        }
    }

    /// The weighted features of each sample.
    #[cfg(test)]
    pub(super) fn values(&self) -> &[f32] {
        &self.values
    }

    /// Real and imaginary parts of all features for each frequency.
    pub(super) fn spectrum(&self) -> impl Iterator<Item = (&[f32], &[f32])> {
        self.spectrum.chunks_exact(2 * self.features).map(|bin| bin.split_at(self.features))
    }
}

#[multiversion(targets("x86_64+avx2+fma", "aarch64+neon"))]
fn add_turned(re: &mut [f32], im: &mut [f32], sample: &[f32], turn: (f32, f32)) {
    for ((re, im), v) in re.iter_mut().zip(im).zip(sample) {
        *re += turn.0 * v;
        *im += turn.1 * v;
    }
}

/// Σ a·b, in sixteen partial sums so that it runs on vectors.
#[multiversion(targets("x86_64+avx2+fma", "aarch64+neon"))]
pub(crate) fn dot(a: &[f32], b: &[f32]) -> f32 {
    let mut sums = [0.0f32; 16];
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<16>(), b.as_chunks::<16>());
    for (a, b) in a.iter().zip(b) {
        for i in 0..16 {
            sums[i] += a[i] * b[i];
        }
    }
    sums.iter().sum::<f32>() + a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum::<f32>()
}

/// `(numerator) += rate · (conj(label) · sample − numerator)` for one frequency.
#[multiversion(targets("x86_64+avx2+fma", "aarch64+neon"))]
pub(super) fn blend_numerator(
    numerator: (&mut [f32], &mut [f32]),
    sample: (&[f32], &[f32]),
    label: (f32, f32),
    rate: f32,
) {
    let old = numerator.0.iter_mut().zip(numerator.1);
    for ((re, im), (x, y)) in old.zip(sample.0.iter().zip(sample.1)) {
        *re += rate * (label.0 * x + label.1 * y - *re);
        *im += rate * (label.0 * y - label.1 * x - *im);
    }
}
