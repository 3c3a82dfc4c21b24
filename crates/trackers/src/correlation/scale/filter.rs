use super::samples::{Samples, blend_numerator, dot};
use crate::correlation::ScaleFilterParams;
use pursuit_geometry::{BBox, Size};
use pursuit_imaging::Frame;
use pursuit_parameters::Parameters;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

impl ScaleFilterParams {
    /// The published settings of fDSST: 17 sizes sampled, 33 interpolated.
    pub fn danelljan2017() -> Self {
        Self { area_px: 512.0, ..Self::default() }
    }

    /// The published settings of DSST: 33 sizes sampled.
    pub fn danelljan2014() -> Self {
        Self { scales: 33, interpolate: false, label_sigma: 33.0 / 16.0, ..Self::danelljan2017() }
    }

    /// Number of sizes the response is interpolated to.
    const fn interpolated(&self) -> usize {
        if self.interpolate { 2 * self.scales - 1 } else { self.scales }
    }

    /// How much of a change of the size of a target at `bbox` is believed, `[0, 1]`.
    fn trust(&self, bbox: &BBox) -> f64 {
        ((bbox.area().sqrt() - self.size_kept_px) / (self.size_followed_px - self.size_kept_px)).clamp(0.0, 1.0)
    }

    /// Interpolated sizes for each sampled one.
    fn density(&self) -> f64 {
        (self.interpolated() - 1) as f64 / (self.scales - 1) as f64
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
        (self.scales / 2) as f64 + (j as f64 - (self.interpolated() / 2) as f64) / self.density()
    }

    /// The Fourier series between the samples: what zero-padding the response interpolates to.
    fn waves(&self) -> Vec<(f64, f64)> {
        let wave = |j: usize, k: usize| {
            let (sin, cos) = (TAU * k as f64 * self.place(j) / self.scales as f64).sin_cos();
            if k == 0 { (0.5, 0.0) } else { (cos, -sin) }
        };
        (0..self.interpolated()).flat_map(|j| (0..self.frequencies()).map(move |k| wave(j, k))).collect()
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
#[serde(try_from = "Raw")]
pub struct ScaleFilter {
    params: ScaleFilterParams,
    patch: Size,
    /// For each frequency, real parts of all features, then imaginary parts.
    numerator: Vec<f32>,
    denominator: Vec<f32>,
    taught: bool,
    #[serde(skip)]
    work: Box<Work>,
}

/// What is stored, before it is checked.
#[derive(Deserialize)]
struct Raw {
    params: ScaleFilterParams,
    patch: Size,
    numerator: Vec<f32>,
    denominator: Vec<f32>,
    taught: bool,
}

impl TryFrom<Raw> for ScaleFilter {
    type Error = &'static str;

    fn try_from(raw: Raw) -> Result<Self, Self::Error> {
        let Raw { params, patch, numerator, denominator, taught } = raw;
        if params.check_all().is_err() || params.scales < 3 {
            return Err("its scale filter has impossible settings");
        }
        if patch.width > LONGEST_SIDE || patch.height > LONGEST_SIDE || patch.area() > LONGEST_SIDE {
            return Err("its scale filter is too large");
        }
        let work = Work::new(&params, patch);
        let bins = params.frequencies();
        if numerator.len() != bins * 2 * work.samples.features() || denominator.len() != bins {
            return Err("its scale filter has the wrong number of coefficients");
        }
        Ok(Self { params, patch, numerator, denominator, taught, work: Box::new(work) })
    }
}

/// Longest side, and largest area, of a sample in pixels: the largest `area_px` there may be.
const LONGEST_SIDE: usize = 65_536;

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
    fn new(settings: &ScaleFilterParams, patch: Size) -> Self {
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
    pub fn new(params: ScaleFilterParams, bbox: &BBox) -> Self {
        let settings = &params;
        let shrink = (settings.area_px / bbox.area().max(1.0)).sqrt().min(1.0);
        let cell = settings.cell_px as f64;
        // At least two cells, and few enough that a long thin target keeps to the area.
        let most = (settings.area_px / (2.0 * cell * cell)).max(2.0);
        let side = |v: f64| ((v * shrink / cell).floor().clamp(2.0, most) * cell) as usize;
        let patch = Size::new(side(bbox.width()), side(bbox.height()));
        let work = Work::new(settings, patch);
        Self {
            numerator: vec![0.0; settings.frequencies() * 2 * work.samples.features()],
            denominator: vec![0.0; settings.frequencies()],
            taught: false,
            work: Box::new(work),
            params,
            patch,
        }
    }

    /// How many times larger than `bbox` the target, centred there, now is, as far as that is believed.
    pub fn locate(&mut self, frame: &Frame, bbox: &BBox) -> f64 {
        let growth = self.measure(frame, bbox);
        growth.powf(self.params.trust(bbox))
    }

    /// How many times larger than `bbox` the target looks.
    fn measure(&mut self, frame: &Frame, bbox: &BBox) -> f64 {
        let (settings, patch) = (&self.params, self.patch);
        let Work { samples, response, waves, .. } = &mut *self.work;
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
        let best = values.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(settings.interpolated() / 2, |(j, _)| j);
        settings.factor(settings.place(best))
    }

    /// Learns the target at `bbox`.
    pub fn learn(&mut self, frame: &Frame, bbox: &BBox) {
        let (settings, patch) = (&self.params, self.patch);
        let Work { samples, label, .. } = &mut *self.work;
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
        for settings in [ScaleFilterParams::danelljan2014(), ScaleFilterParams::danelljan2017()] {
            let mut filter = ScaleFilter::new(settings.clone(), &bbox);
            filter.learn(&frame(1.0), &bbox);
            for size in [0.88, 0.94, 1.0, 1.06, 1.13] {
                let found = filter.locate(&frame(size), &bbox);
                assert!((found / size).ln().abs() < 0.025, "{found} is not {size}");
            }
        }
    }

    #[test]
    fn the_learned_sample_is_answered_by_the_label() {
        let bbox = BBox::from_center_size(Point::new(80.0, 80.0), 48.0, 40.0);
        let settings = ScaleFilterParams { lambda: 0.0, ..ScaleFilterParams::danelljan2014() };
        let mut filter = ScaleFilter::new(settings.clone(), &bbox);
        filter.learn(&frame(1.0), &bbox);
        assert!((filter.locate(&frame(1.0), &bbox) - 1.0).abs() < 1e-12);
        let response = &filter.work.response;
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
        let settings = ScaleFilterParams::danelljan2017();
        let (n, middle) = (settings.scales, (settings.scales / 2) as f64);
        let mut filter = ScaleFilter::new(settings.clone(), &bbox);
        let samples = |filter: &ScaleFilter| {
            let samples = &filter.work.samples;
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
        for (k, got) in filter.work.response.iter().enumerate() {
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
            let mut filter = ScaleFilter::new(ScaleFilterParams::danelljan2017(), &bbox);
            assert!(filter.patch.area() <= 512, "{w}x{h}: {}", filter.patch);
            filter.learn(&frame(1.0), &bbox);
            assert!(filter.locate(&frame(1.0), &bbox) > 0.5);
        }
    }

    #[test]
    fn changes_of_tiny_targets_are_believed_in_part() {
        let bbox = BBox::from_center_size(Point::new(80.0, 80.0), 48.0, 40.0);
        let side = bbox.area().sqrt();
        let growth = |kept: f64, followed: f64| {
            let params =
                ScaleFilterParams { size_kept_px: kept, size_followed_px: followed, ..ScaleFilterParams::default() };
            let mut filter = ScaleFilter::new(params, &bbox);
            filter.learn(&frame(1.0), &bbox);
            filter.locate(&frame(1.13), &bbox)
        };
        let whole = growth(0.0, 1.0);
        assert!(whole > 1.08);
        assert_eq!(growth(side, side + 1.0), 1.0);
        assert!((growth(0.0, 2.0 * side) - whole.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn states_that_do_not_fit_are_refused() {
        let back = |f: &ScaleFilter| postcard::from_bytes::<ScaleFilter>(&postcard::to_stdvec(f).unwrap());
        let bbox = BBox::from_ltwh(0.0, 0.0, 3.0, 300.0);
        let mut filter = ScaleFilter::new(ScaleFilterParams::danelljan2017(), &bbox);
        assert_eq!(back(&filter).unwrap().patch, filter.patch);
        filter.patch = Size::new(1 << 20, 1 << 20);
        assert!(back(&filter).is_err());
        let mut filter = ScaleFilter::new(ScaleFilterParams::danelljan2017(), &bbox);
        filter.numerator.pop();
        assert!(back(&filter).is_err());
        let mut filter = ScaleFilter::new(ScaleFilterParams::danelljan2017(), &bbox);
        filter.denominator.push(1.0);
        assert!(back(&filter).is_err());
        filter.denominator.pop();
        filter.params.scales = 1;
        assert!(back(&filter).is_err());
    }
}
