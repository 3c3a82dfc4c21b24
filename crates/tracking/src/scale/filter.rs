use super::samples::{Samples, blend_numerator, dot};
use pursuit_geometry::{BBox, Size};
use pursuit_imaging::Frame;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Settings of a [`ScaleFilter`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ScaleSettings {
    /// Number of sizes sampled, odd, 3 to 63 (danelljan2017, section 5.2: 17; danelljan2014: 33).
    pub scales: usize,
    /// Number of sizes the response is interpolated to, odd, at least `scales` (33).
    pub interpolated: usize,
    /// Ratio of neighbouring interpolated sizes, a (1.02).
    pub step: f64,
    /// Standard deviation of the label in sampled sizes (1/16 of their number).
    pub label_sigma: f64,
    /// Share of the new sample, η (0.025).
    pub learning_rate: f64,
    /// Regularisation, λ (0.01).
    pub lambda: f64,
    /// Largest area of a sample in pixels (512).
    pub area_px: f64,
    /// Side of a HOG cell in pixels (4).
    pub cell_px: usize,
}

impl ScaleSettings {
    /// As in fDSST: 17 sizes sampled, 33 interpolated.
    pub const fn danelljan2017() -> Self {
        Self {
            scales: 17,
            interpolated: 33,
            step: 1.02,
            label_sigma: 17.0 / 16.0,
            learning_rate: 0.025,
            lambda: 0.01,
            area_px: 512.0,
            cell_px: 4,
        }
    }

    /// As in DSST: 33 sizes sampled.
    pub const fn danelljan2014() -> Self {
        Self { scales: 33, label_sigma: 33.0 / 16.0, ..Self::danelljan2017() }
    }

    /// Interpolated sizes for each sampled one.
    fn density(&self) -> f64 {
        (self.interpolated - 1) as f64 / (self.scales - 1) as f64
    }

    /// Size factor of sample `i`, which may lie between samples.
    pub(super) fn factor(&self, i: f64) -> f64 {
        self.step.powf((i - (self.scales / 2) as f64) * self.density())
    }

    pub(super) const fn frequencies(&self) -> usize {
        self.scales / 2 + 1
    }

    /// Place of interpolated size `j` among the sampled ones.
    fn place(&self, j: usize) -> f64 {
        (self.scales / 2) as f64 + (j as f64 - (self.interpolated / 2) as f64) / self.density()
    }

    /// The Fourier series between the samples: what zero-padding the response interpolates to.
    fn waves(&self) -> Vec<(f64, f64)> {
        let wave = |j: usize, k: usize| {
            let (sin, cos) = (TAU * k as f64 * self.place(j) / self.scales as f64).sin_cos();
            if k == 0 { (0.5, 0.0) } else { (cos, -sin) }
        };
        (0..self.interpolated).flat_map(|j| (0..self.frequencies()).map(move |k| wave(j, k))).collect()
    }

    /// Spectrum of the label, a Gaussian about the middle sample.
    fn label(&self) -> Vec<(f32, f32)> {
        let (n, middle) = (self.scales, (self.scales / 2) as f64);
        let bin = |k: usize| {
            let (mut re, mut im) = (0.0, 0.0);
            for i in 0..n {
                let y = (-0.5 * ((i as f64 - middle) / self.label_sigma).powi(2)).exp();
                let (sin, cos) = (TAU * (k * i) as f64 / n as f64).sin_cos();
                (re, im) = (re + y * cos, im - y * sin);
            }
            (re as f32, im as f32)
        };
        (0..self.frequencies()).map(bin).collect()
    }
}

/// A correlation filter over a row of sizes: every HOG feature of the target, resampled to one size, is a channel, and the
/// signal runs along scale (danelljan2014, section 4; interpolated as danelljan2017, section 4.2).
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct ScaleFilter {
    settings: ScaleSettings,
    patch: Size,
    /// For each frequency, real parts of all features, then imaginary parts.
    numerator: Vec<f32>,
    denominator: Vec<f32>,
    taught: bool,
    #[serde(skip)]
    work: Option<Box<Work>>,
}

/// What is made from the settings, and what is overwritten at every use.
#[derive(Debug, Clone)]
struct Work {
    samples: Samples,
    label: Vec<(f32, f32)>,
    response: Vec<(f64, f64)>,
    /// For each interpolated size, what the parts of each frequency of the response weigh in its value.
    waves: Vec<(f64, f64)>,
}

impl Work {
    fn new(settings: &ScaleSettings, patch: Size) -> Self {
        Self {
            samples: Samples::new(settings, patch),
            label: settings.label(),
            response: Vec::with_capacity(settings.frequencies()),
            waves: settings.waves(),
        }
    }
}

impl ScaleFilter {
    /// An untaught filter for a target of the size of `bbox`.
    pub fn new(settings: ScaleSettings, bbox: &BBox) -> Self {
        let shrink = (settings.area_px / bbox.area().max(1.0)).sqrt().min(1.0);
        let cell = settings.cell_px as f64;
        // At least two cells, and few enough that a long thin target keeps to the area.
        let most = (settings.area_px / (2.0 * cell * cell)).max(2.0);
        let side = |v: f64| ((v * shrink / cell).floor().clamp(2.0, most) * cell) as usize;
        let patch = Size::new(side(bbox.width()), side(bbox.height()));
        let work = Work::new(&settings, patch);
        Self {
            numerator: vec![0.0; settings.frequencies() * 2 * work.samples.features()],
            denominator: vec![0.0; settings.frequencies()],
            taught: false,
            work: Some(Box::new(work)),
            settings,
            patch,
        }
    }

    /// How many times larger than `bbox` the target, centred there, now is.
    pub fn locate(&mut self, frame: &Frame, bbox: &BBox) -> f64 {
        let (settings, patch) = (&self.settings, self.patch);
        let Work { samples, response, waves, .. } =
            &mut **self.work.get_or_insert_with(|| Box::new(Work::new(settings, patch)));
        samples.take(frame, bbox, patch);
        let features = samples.features();
        let filter = self.numerator.chunks_exact(2 * features).zip(&self.denominator);
        response.clear();
        for ((x, y), (numerator, denominator)) in samples.spectrum().zip(filter) {
            let (a, b) = numerator.split_at(features);
            let scale = 1.0 / (f64::from(*denominator) + settings.lambda);
            response.push((f64::from(dot(a, x) + dot(b, y)) * scale, f64::from(dot(a, y) - dot(b, x)) * scale));
        }
        let value = |waves: &[(f64, f64)]| -> f64 {
            response.iter().zip(waves).map(|((re, im), (cos, sin))| re * cos + im * sin).sum()
        };
        let values = waves.chunks_exact(settings.frequencies()).map(value).enumerate();
        let best = values.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(settings.interpolated / 2, |(j, _)| j);
        settings.factor(settings.place(best))
    }

    /// Learns the target at `bbox`.
    pub fn learn(&mut self, frame: &Frame, bbox: &BBox) {
        let (settings, patch) = (&self.settings, self.patch);
        let Work { samples, label, .. } = &mut **self.work.get_or_insert_with(|| Box::new(Work::new(settings, patch)));
        samples.take(frame, bbox, patch);
        let rate = if self.taught { settings.learning_rate as f32 } else { 1.0 };
        let features = samples.features();
        let filter = self.numerator.chunks_exact_mut(2 * features).zip(&mut self.denominator);
        for (((x, y), label), (numerator, denominator)) in samples.spectrum().zip(label.iter()).zip(filter) {
            *denominator += rate * (dot(x, x) + dot(y, y) - *denominator);
            blend_numerator(numerator.split_at_mut(features), (x, y), *label, rate);
        }
        self.taught = true;
    }

    /// Makes scratch anew after a saved state has been read.
    ///
    /// # Errors
    /// What does not fit.
    pub fn revive(&mut self) -> Result<(), String> {
        let s = &self.settings;
        let odd = |n: usize| !n.is_multiple_of(2);
        if !(odd(s.scales) && (3..=63).contains(&s.scales) && odd(s.interpolated) && s.interpolated >= s.scales) {
            return Err("its scale filter has an impossible number of sizes".into());
        }
        if s.interpolated > 1023 || !(2..=16).contains(&s.cell_px) || self.patch.area() > 65_536 {
            return Err("its scale filter is too large".into());
        }
        let work = Work::new(s, self.patch);
        let bins = s.frequencies();
        if self.numerator.len() != bins * 2 * work.samples.features() || self.denominator.len() != bins {
            return Err("its scale filter has the wrong number of coefficients".into());
        }
        self.work = Some(Box::new(work));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_geometry::Point;
    use pursuit_imaging::Image;

    /// A pattern about the middle of the frame, `size` times as large as at first.
    fn frame(size: f64) -> Frame {
        let wave = |x: f64, y: f64| (x * 0.31).sin() * (y * 0.23).cos() + (x * 0.11 + y * 0.17).sin();
        let image = Image::from_fn(160, 160, |x, y| {
            let (x, y) = ((x as f64 + 0.5 - 80.0) / size, (y as f64 + 0.5 - 80.0) / size);
            let inside = x.abs() < 24.0 && y.abs() < 20.0;
            (128.0 + if inside { 50.0 * wave(x, y) } else { 0.0 }) as u8
        });
        Frame::new(0, 0.0, image.unwrap())
    }

    #[test]
    fn growth_and_shrinking_are_measured() {
        let bbox = BBox::from_center_size(Point::new(80.0, 80.0), 48.0, 40.0);
        for settings in [ScaleSettings::danelljan2014(), ScaleSettings::danelljan2017()] {
            let mut filter = ScaleFilter::new(settings, &bbox);
            filter.learn(&frame(1.0), &bbox);
            for size in [0.88, 0.94, 1.0, 1.06, 1.13] {
                let found = filter.locate(&frame(size), &bbox);
                assert!((found / size).ln().abs() < 0.025, "{found} is not {size}");
            }
        }
    }

    #[test]
    fn the_response_to_what_was_learned_is_the_label() {
        let bbox = BBox::from_center_size(Point::new(80.0, 80.0), 48.0, 40.0);
        let settings = ScaleSettings { lambda: 0.0, ..ScaleSettings::danelljan2014() };
        let mut filter = ScaleFilter::new(settings, &bbox);
        filter.learn(&frame(1.0), &bbox);
        assert!((filter.locate(&frame(1.0), &bbox) - 1.0).abs() < 1e-12);
        let response = &filter.work.as_ref().unwrap().response;
        for (got, want) in response.iter().zip(settings.label()) {
            assert!((got.0 - f64::from(want.0)).abs() < 1e-3 && (got.1 - f64::from(want.1)).abs() < 1e-3);
        }
    }

    /// The filter as danelljan2017 states it: features compressed to as many dimensions as there are samples by the QR
    /// decomposition of the template, everything by its definition in `f64`.
    #[test]
    fn compression_by_qr_changes_nothing() {
        use nalgebra::{Complex, DMatrix};
        let bbox = BBox::from_center_size(Point::new(80.0, 80.0), 48.0, 40.0);
        let settings = ScaleSettings::danelljan2017();
        let (n, middle) = (settings.scales, (settings.scales / 2) as f64);
        let mut filter = ScaleFilter::new(settings, &bbox);
        let samples = |filter: &ScaleFilter| {
            let samples = &filter.work.as_ref().unwrap().samples;
            DMatrix::from_column_slice(samples.features(), n, samples.values()).map(f64::from)
        };
        let dft = |x: &DMatrix<f64>| {
            let turn = |i: usize, k: usize| Complex::from_polar(1.0, -TAU * (i * k) as f64 / n as f64);
            x.map(Complex::from) * DMatrix::from_fn(n, n, turn)
        };
        let label = DMatrix::from_fn(1, n, |_, i| (-0.5 * ((i as f64 - middle) / settings.label_sigma).powi(2)).exp());
        let (label, rate) = (dft(&label), settings.learning_rate);
        filter.learn(&frame(1.0), &bbox);
        let first = samples(&filter);
        filter.learn(&frame(1.04), &bbox);
        let second = samples(&filter);
        let power = |x: &DMatrix<f64>| dft(&x.clone().qr().q().tr_mul(x)).map(|v| v.norm_sqr()).row_sum();
        let denominator = power(&first) * (1.0 - rate) + power(&second) * rate;
        let template = &first * (1.0 - rate) + &second * rate;
        let basis = template.clone().qr().q();
        assert_eq!(basis.ncols(), n);
        let numerator = dft(&basis.tr_mul(&template));

        let _ = filter.locate(&frame(1.1), &bbox);
        let seen = dft(&basis.tr_mul(&samples(&filter)));
        for (k, got) in filter.work.as_ref().unwrap().response.iter().enumerate() {
            let sum: Complex<f64> = (0..n).map(|d| label[k] * numerator[(d, k)].conj() * seen[(d, k)]).sum();
            let want = sum / (denominator[k] + settings.lambda);
            let apart = (got.0 - want.re).hypot(got.1 - want.im);
            assert!(apart < 1e-3 * label[0].re, "frequency {k}: {got:?} is not {want}");
        }
    }

    #[test]
    fn thin_and_tiny_targets_have_bounded_samples() {
        for (w, h) in [(1.0, 1.0), (2.0, 400.0), (900.0, 3.0), (1e5, 1e5)] {
            let bbox = BBox::from_center_size(Point::new(80.0, 80.0), w, h);
            let mut filter = ScaleFilter::new(ScaleSettings::danelljan2017(), &bbox);
            assert!(filter.patch.area() <= 512, "{w}x{h}: {}", filter.patch);
            filter.learn(&frame(1.0), &bbox);
            assert!(filter.locate(&frame(1.0), &bbox) > 0.5);
        }
    }

    #[test]
    fn states_that_do_not_fit_are_refused() {
        let mut filter = ScaleFilter::new(ScaleSettings::danelljan2017(), &BBox::from_ltwh(0.0, 0.0, 3.0, 300.0));
        assert!(filter.revive().is_ok());
        filter.numerator.pop();
        assert!(filter.revive().is_err());
        filter.settings.scales = 1;
        assert!(filter.revive().is_err());
    }
}
