//! A one-dimensional correlation filter along scale (danelljan2014, section 3.2; danelljan2017, section 4.2).

use pursuit_geometry::{BBox, Point, Size};
use pursuit_imaging::Frame;
use pursuit_vision::fourier::Complex32;
use pursuit_vision::fourier::spectra::{add_conj_product, blend};
use pursuit_vision::hog::{Hog, HogLayout};
use pursuit_vision::sampling::{Planes, Sampler, Window};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

use super::Spectra;

/// Settings of a [`ScaleFilter`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ScaleFilterSettings {
    /// Number of sizes sampled, S; odd.
    pub sampled: usize,
    /// Number of sizes the response is interpolated to (danelljan2017: S* = 33 from S = 17); odd.
    pub interpolated: usize,
    /// Ratio of neighbouring interpolated sizes, a.
    pub step: f64,
    /// Standard deviation of the label, in sampled sizes.
    pub sigma: f64,
    /// Share of a new sample, η.
    pub learning_rate: f64,
    /// Regularisation λ.
    pub lambda: f64,
    /// Largest area of a sample in pixels.
    pub area_px: f64,
    /// Side of a HOG cell in pixels.
    pub cell_px: usize,
}

/// Learns what the target looks like at its own and at neighbouring sizes, and says by how much it has grown.
///
/// Every size is a sample of HOG features; the transform runs along the sizes, one for each feature, and the filter is that of
/// minimum squared error: A = conj(G) F, B = Σ |F|² over all features.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct ScaleFilter {
    settings: ScaleFilterSettings,
    patch: Size,
    /// A: for each frequency 0 … S/2 one value a feature.
    numerator: Spectra,
    /// B for each frequency.
    denominator: Vec<f32>,
    #[serde(skip)]
    work: Option<Work>,
}

/// What is made from the settings, and what is overwritten at every use.
#[derive(Debug, Clone)]
struct Work {
    hog: Hog,
    sampler: Sampler,
    patch: Planes,
    planes: Planes,
    /// The features of all sizes, one after the other, weighted by a Hann window along the sizes.
    samples: Vec<f32>,
    /// For each frequency one value a feature.
    spectrum: Vec<Complex32>,
    hann: Vec<f32>,
    label: Vec<Complex32>,
    features: usize,
}

impl ScaleFilterSettings {
    /// Sampled size `i` relative to the present one; sizes lie further apart than the interpolated ones.
    fn factor(&self, i: usize) -> f64 {
        self.step.powf((i as f64 - (self.sampled / 2) as f64) * self.spacing())
    }

    /// Interpolated sizes from one sampled size to the next.
    fn spacing(&self) -> f64 {
        (self.interpolated.max(2) - 1) as f64 / (self.sampled.max(2) - 1) as f64
    }

    /// Frequencies of a real signal over the sampled sizes.
    const fn bins(&self) -> usize {
        self.sampled / 2 + 1
    }
}

impl Work {
    fn new(settings: &ScaleFilterSettings, patch: Size) -> Self {
        let hog = Hog::new(HogLayout::Felzenszwalb31, settings.cell_px);
        let features = hog.grid(patch).area() * hog.channels();
        let n = settings.sampled;
        let hann = |i: usize| (0.5 - 0.5 * (TAU * (i as f64 + 1.0) / (n as f64 + 1.0)).cos()) as f32;
        let wanted = |i: usize| (-0.5 * ((i as f64 - (n / 2) as f64) / settings.sigma).powi(2)).exp();
        let bin = |k: usize| (0..n).map(|i| turn(k, i, n) * wanted(i) as f32).sum();
        Self {
            sampler: Sampler::new(),
            patch: Planes::default(),
            planes: Planes::default(),
            samples: vec![0.0; n * features],
            spectrum: vec![Complex32::default(); settings.bins() * features],
            hann: (0..n).map(hann).collect(),
            label: (0..settings.bins()).map(bin).collect(),
            features,
            hog,
        }
    }

    /// The spectrum of the features around `center` at all sizes.
    fn transform(
        &mut self,
        settings: &ScaleFilterSettings,
        frame: &Frame,
        center: Point,
        size: (f64, f64),
        patch: Size,
    ) {
        for (i, sample) in self.samples.chunks_exact_mut(self.features.max(1)).enumerate() {
            let factor = settings.factor(i);
            let region = BBox::from_center_size(center, size.0 * factor, size.1 * factor);
            self.sampler.gray(frame.gray(), &Window::of_region(region, patch), &mut self.patch);
            self.hog.extract(&self.patch, &mut self.planes);
            let weight = self.hann[i];
            sample.iter_mut().zip(self.planes.as_slice()).for_each(|(s, v)| *s = weight * v);
        }
        for (k, bin) in self.spectrum.chunks_exact_mut(self.features.max(1)).enumerate() {
            bin.fill(Complex32::default());
            for (i, sample) in self.samples.chunks_exact(self.features.max(1)).enumerate() {
                add_turned(bin, sample, turn(k, i, settings.sampled));
            }
        }
    }
}

/// exp(−2πi·ki/n).
fn turn(k: usize, i: usize, n: usize) -> Complex32 {
    let (sin, cos) = (-TAU * ((k * i) % n) as f64 / n as f64).sin_cos();
    Complex32::new(cos as f32, sin as f32)
}

#[multiversion::multiversion(targets("x86_64+avx2+fma", "aarch64+neon"))]
fn add_turned(bin: &mut [Complex32], sample: &[f32], turn: Complex32) {
    for (bin, v) in bin.iter_mut().zip(sample) {
        bin.re += turn.re * v;
        bin.im += turn.im * v;
    }
}

impl ScaleFilter {
    /// Taught with the target at `bbox`.
    pub fn new(settings: ScaleFilterSettings, frame: &Frame, bbox: &BBox) -> Self {
        let shrink = (settings.area_px / bbox.area()).sqrt().min(1.0);
        let cell = settings.cell_px as f64;
        let longest = settings.area_px / cell;
        // At least two cells each way; a very thin target is not sampled longer than the area allows.
        let side = |v: f64| ((v * shrink).min(longest) / cell).floor().max(2.0) as usize * settings.cell_px;
        let patch = Size::new(side(bbox.width()), side(bbox.height()));
        let mut this = Self {
            settings,
            patch,
            numerator: Spectra::default(),
            denominator: Vec::new(),
            work: Some(Work::new(&settings, patch)),
        };
        this.learn(frame, bbox);
        this
    }

    /// The factor by which the target at `bbox` has grown.
    pub fn locate(&mut self, frame: &Frame, bbox: &BBox) -> f64 {
        let Some(work) = &mut self.work else { return 1.0 };
        let s = &self.settings;
        work.transform(s, frame, bbox.center(), (bbox.width(), bbox.height()), self.patch);
        // The first entries of the spectrum, which is not needed any more, take the response's.
        for k in 0..s.bins() {
            let range = k * work.features..(k + 1) * work.features;
            let mut lanes = [Complex32::default(); 8];
            for (a, f) in self.numerator.0[range.clone()].chunks(8).zip(work.spectrum[range].chunks(8)) {
                add_conj_product(&mut lanes[..a.len()], a, f);
            }
            let sum: Complex32 = lanes.iter().sum();
            work.spectrum[k] = sum / (self.denominator[k] + s.lambda as f32);
        }
        // The trigonometric polynomial through the response, read at the interpolated sizes.
        let response = |place: f64| {
            let terms = (1..s.bins()).map(|k| {
                let (sin, cos) = (TAU * k as f64 * place / s.sampled as f64).sin_cos();
                2.0 * (f64::from(work.spectrum[k].re) * cos - f64::from(work.spectrum[k].im) * sin)
            });
            f64::from(work.spectrum[0].re) + terms.sum::<f64>()
        };
        let steps = |i: usize| i as f64 - (s.interpolated / 2) as f64;
        let value = |i: usize| response(steps(i) / s.spacing() + (s.sampled / 2) as f64);
        let best = (0..s.interpolated).map(|i| (i, value(i))).max_by(|a, b| a.1.total_cmp(&b.1));
        best.map_or(1.0, |(i, _)| s.step.powf(steps(i)))
    }

    /// Learns the target at `bbox`.
    pub fn learn(&mut self, frame: &Frame, bbox: &BBox) {
        let Some(work) = &mut self.work else { return };
        let s = &self.settings;
        work.transform(s, frame, bbox.center(), (bbox.width(), bbox.height()), self.patch);
        let first = self.denominator.is_empty();
        if first {
            self.denominator.resize(s.bins(), 0.0);
            self.numerator.0.resize(work.spectrum.len(), Complex32::default());
        }
        let rate = if first { 1.0 } else { s.learning_rate as f32 };
        for (k, bin) in work.spectrum.chunks_exact_mut(work.features.max(1)).enumerate() {
            let power: f32 = bin.iter().map(Complex32::norm_sqr).sum();
            self.denominator[k] += rate * (power - self.denominator[k]);
            let label = work.label[k].conj();
            bin.iter_mut().for_each(|f| *f *= label);
        }
        blend(&mut self.numerator.0, &work.spectrum, rate);
    }

    /// Makes what is not saved anew.
    ///
    /// # Errors
    /// What does not hold together.
    pub fn revive(&mut self) -> Result<(), String> {
        let s = &self.settings;
        let sane = (3..=99).contains(&s.sampled)
            && (3..=999).contains(&s.interpolated)
            && (1..=64).contains(&s.cell_px)
            && self.patch.width <= 4096
            && self.patch.height <= 4096;
        if sane {
            let work = Work::new(s, self.patch);
            if self.numerator.0.len() == work.spectrum.len() && self.denominator.len() == s.bins() {
                self.work = Some(work);
                return Ok(());
            }
        }
        Err("its scale filter does not have the right size".into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_imaging::{Image, Pixels};

    fn settings() -> ScaleFilterSettings {
        ScaleFilterSettings {
            sampled: 17,
            interpolated: 33,
            step: 1.02,
            sigma: 1.0,
            learning_rate: 0.025,
            lambda: 0.01,
            area_px: 1024.0,
            cell_px: 4,
        }
    }

    /// A pattern about (80, 60), `zoom` times as large as at first.
    fn frame(zoom: f64) -> Frame {
        let image = Image::from_fn(160, 120, |x, y| {
            let (u, v) = ((x as f64 + 0.5 - 80.0) / zoom, (y as f64 + 0.5 - 60.0) / zoom);
            let inside = u.abs() < 24.0 && v.abs() < 20.0;
            let wave = (u * 0.5).sin() * (v * 0.4 + 0.03 * u).cos();
            (if inside { 128.0 + 110.0 * wave } else { 128.0 + 25.0 * ((x * 7 + y * 3) as f64 * 0.1).sin() }) as u8
        });
        Frame::new(0, 0.0, Pixels::Gray8(image.unwrap()))
    }

    #[test]
    fn growth_is_measured() {
        let bbox = BBox::from_center_size(Point::new(80.0, 60.0), 48.0, 40.0);
        let filter = ScaleFilter::new(settings(), &frame(1.0), &bbox);
        for zoom in [0.9, 0.96, 1.0, 1.04, 1.1] {
            let found = filter.clone().locate(&frame(zoom), &bbox);
            assert!((found / zoom - 1.0).abs() < 0.021, "{found} is not {zoom}");
        }
    }

    #[test]
    fn thin_and_tiny_targets_have_bounded_samples() {
        for (w, h) in [(1.0, 1.0), (2.0, 400.0), (900.0, 3.0), (1e5, 1e5)] {
            let bbox = BBox::from_center_size(Point::new(80.0, 60.0), w, h);
            let mut filter = ScaleFilter::new(settings(), &frame(1.0), &bbox);
            assert!(filter.patch.area() <= 8 * 256, "{w}x{h}: {}", filter.patch);
            assert!(filter.locate(&frame(1.0), &bbox) > 0.5);
        }
    }
}
