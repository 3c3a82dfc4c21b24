//! The circulant sparse coder of `cst` (zhang2016).
//!
//! A window x of D channels is written as a sum of shifted templates. All shifts of a template a are the columns of a circulant
//! matrix A, so that A z is the circular convolution of a and z, and the code minimises
//!
//! ```text
//! ½ Σ_d ‖x_d − Σ_k A_k,d z_k‖²  +  λ Σ_k ‖z_k‖₁
//! ```
//!
//! one code z_k for all channels of a template. A coefficient says how much of the target is seen at that shift: where the code is
//! greatest, the target is. It is split by z = y and solved by alternating directions; z is one small system in every bin of the
//! transform, whose inverse does not change until the templates do.

mod codes;
#[cfg(test)]
mod reference;

use super::{ResponseFilter, Spectra, mean_power};
use codes::{Bins, shrink, sum_planes};
use pursuit_geometry::Size;
use pursuit_parameters::Parameters;
use pursuit_vision::fourier::{Complex32, FftScratch, RealFft2, gaussian_label, spectra};
use pursuit_vision::sampling::Planes;
use serde::{Deserialize, Serialize};

pursuit_parameters::parameters! {
    /// The circulant sparse code.
    pub struct SparseCodeParams {
        /// Templates, K: from two on the first is that of the first frame, the next a running average, and each further one forgets a
        /// quarter as fast as the one before.
        pub templates: usize = 2, in 1..=4, source "ours; zhang2016, section 3: a set of base templates";
        /// Weight λ of the sum of the coefficients; templates and windows have length one.
        pub lambda: f64 = 0.02, in 0.0..=1.0, source "ours; zhang2016, eq. 2";
        /// Penalty ρ of the alternating directions.
        pub penalty: f64 = 0.1, in 1e-4..=100.0, source "ours";
        /// Iterations of the alternating directions.
        pub iterations: usize = 8, in 1..=500, source "ours";
    }
}

/// What a further template keeps of the rate of the one before.
const SLOWER: f64 = 0.25;

/// Codes windows by shifted templates; see the [module](self).
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(remote = "CirculantCoder")]
pub struct CirculantCoder {
    params: SparseCodeParams,
    grid: Size,
    channels: usize,
    label_sigma: f64,
    /// All channels of a template one after the other, template after template; of length one.
    templates: Spectra,
    taught: bool,
    #[serde(skip)]
    work: Work,
}

pursuit_estimation::checked!(CirculantCoder);

impl CirculantCoder {
    fn restored(self) -> Result<Self, &'static str> {
        let Self { grid, channels, label_sigma, .. } = self;
        let sides = 1..=4096;
        let possible = sides.contains(&grid.width) && sides.contains(&grid.height) && (1..=1024).contains(&channels);
        let has_label = label_sigma.is_finite() && label_sigma > 0.0;
        if !possible || !has_label || self.params.check_all().is_err() {
            return Err("its sparse code has impossible settings");
        }
        let bins = (grid.width / 2 + 1) * grid.height * channels * self.params.templates;
        if self.templates.0.len() != bins || !self.templates.0.iter().all(|v| v.re.is_finite() && v.im.is_finite()) {
            return Err("its templates do not have the size of their grid");
        }
        let mut coder = Self { work: Work::new(&self.params, grid, channels, label_sigma), ..self };
        coder.prepare();
        Ok(coder)
    }
}

/// Plans, what follows from the templates, and scratch; not state.
#[derive(Debug, Clone)]
struct Work {
    plan: RealFft2,
    fft: FftScratch,
    label: Vec<Complex32>,
    /// The inverses of the systems of the bins.
    inverse: Bins,
    sample: Vec<Complex32>,
    /// Aᵀx, and what is solved for z, template after template.
    seen: Vec<Complex32>,
    wanted: Vec<Complex32>,
    spectrum: Vec<Complex32>,
    /// y and the dual, template after template, and a plane of z.
    codes: Vec<f32>,
    duals: Vec<f32>,
    plane: Vec<f32>,
    power: Vec<f32>,
    series: Vec<Complex32>,
}

/// Of a grid of one cell: made anew for the coder's own.
impl Default for Work {
    fn default() -> Self {
        Self::new(&SparseCodeParams::default(), Size::new(1, 1), 1, 1.0)
    }
}

impl Work {
    fn new(params: &SparseCodeParams, grid: Size, channels: usize, label_sigma: f64) -> Self {
        let plan = RealFft2::new(grid.width, grid.height);
        let (bins, zero, k) = (plan.spectrum_len(), Complex32::default(), params.templates);
        let (mut label, mut fft) = (vec![zero; bins], FftScratch::default());
        plan.forward(&gaussian_label(grid.width, grid.height, label_sigma, label_sigma), &mut label, &mut fft);
        Self {
            fft,
            label,
            inverse: Bins::new(k, bins),
            sample: vec![zero; bins * channels],
            seen: vec![zero; bins * k],
            wanted: vec![zero; bins * k],
            spectrum: vec![zero; bins],
            codes: vec![0.0; grid.area() * k],
            duals: vec![0.0; grid.area() * k],
            plane: vec![0.0; grid.area()],
            power: vec![0.0; bins],
            series: vec![zero; bins],
            plan,
        }
    }

    /// The spectra of `features`, of length one unless there is nothing to see.
    fn transform(&mut self, features: &Planes) {
        let bins = self.plan.spectrum_len();
        for (plane, out) in features.planes().zip(self.sample.chunks_exact_mut(bins)) {
            self.plan.forward(plane, out, &mut self.fft);
        }
        normalise(&self.plan, &mut self.sample, &mut self.power);
    }
}

/// Makes the sum of squares of the planes of some spectra one.
fn normalise(plan: &RealFft2, all: &mut [Complex32], power: &mut [f32]) {
    power.fill(0.0);
    all.chunks_exact(power.len()).for_each(|x| spectra::add_power(power, x));
    let energy = mean_power(plan, power);
    let factor = if energy > 1e-12 { energy.sqrt().recip() } else { 0.0 };
    all.iter_mut().for_each(|v| *v *= factor);
}

impl CirculantCoder {
    /// Without templates yet, for `channels` planes of `grid` cells; the code is read through a Gaussian of `label_sigma` cells, because
    /// a shift between cells is one of several.
    pub fn new(params: SparseCodeParams, grid: Size, channels: usize, label_sigma: f64) -> Self {
        let work = Work::new(&params, grid, channels, label_sigma);
        let templates = Spectra(vec![Complex32::default(); work.sample.len() * params.templates]);
        Self { params, grid, channels, label_sigma, templates, taught: false, work }
    }

    /// Makes the inverses of the systems (Σ_d conj(â_k,d) â_l,d + ρ I) of all bins.
    fn prepare(&mut self) {
        let Work { inverse, spectrum, .. } = &mut self.work;
        let (count, all) = (self.params.templates, &self.templates.0);
        let (of_template, bins) = (all.len() / count, spectrum.len());
        for (k, l) in (0..count).flat_map(|k| (0..count).map(move |l| (k, l))) {
            spectrum.fill(Complex32::default());
            let of = |k: usize| all[k * of_template..][..of_template].chunks_exact(bins);
            of(k).zip(of(l)).for_each(|(a, b)| spectra::add_conj_product(spectrum, a, b));
            inverse.entry(k, l).copy_from_slice(spectrum);
        }
        inverse.invert(self.params.penalty as f32);
    }

    /// The codes of the sample that was transformed last, into `codes`.
    fn code(&mut self) {
        let count = self.params.templates;
        let (lambda, penalty) = (self.params.lambda as f32, self.params.penalty as f32);
        let Work { plan, fft, inverse, sample, seen, wanted, spectrum, codes, duals, plane, .. } = &mut self.work;
        let (bins, cells) = (plan.spectrum_len(), plane.len());
        seen.fill(Complex32::default());
        for (template, seen) in self.templates.0.chunks_exact(sample.len()).zip(seen.chunks_exact_mut(bins)) {
            let channels = template.chunks_exact(bins).zip(sample.chunks_exact(bins));
            channels.for_each(|(a, x)| spectra::add_conj_product(seen, a, x));
        }
        codes.fill(0.0);
        duals.fill(0.0);
        wanted.copy_from_slice(seen);
        for iteration in 1..=self.params.iterations {
            for k in 0..count {
                spectrum.fill(Complex32::default());
                for (l, wanted) in wanted.chunks_exact(bins).enumerate() {
                    spectra::add_product(spectrum, inverse.get(k, l), wanted);
                }
                plan.inverse(spectrum, plane, fft);
                let own = k * cells..(k + 1) * cells;
                shrink(plane, &mut codes[own.clone()], &mut duals[own], lambda / penalty);
            }
            if iteration == self.params.iterations {
                break;
            }
            for (k, wanted) in wanted.chunks_exact_mut(bins).enumerate() {
                let own = k * cells..(k + 1) * cells;
                plane
                    .iter_mut()
                    .zip(&codes[own.clone()])
                    .zip(&duals[own])
                    .for_each(|((p, y), u)| *p = penalty * (y - u));
                plan.forward(plane, wanted, fft);
                wanted.iter_mut().zip(&seen[k * bins..]).for_each(|(w, s)| *w += s);
            }
        }
    }
}

impl ResponseFilter for CirculantCoder {
    fn respond(&mut self, features: &Planes, response: &mut [f32]) {
        self.work.transform(features);
        self.code();
        let Work { plan, fft, label, codes, spectrum, plane, series, .. } = &mut self.work;
        sum_planes(codes, plane);
        plan.forward(plane, spectrum, fft);
        series.fill(Complex32::default());
        spectra::add_product(series, spectrum, label);
        plan.inverse(series, response, fft);
    }

    fn learn(&mut self, features: &Planes, rate: f64) {
        self.work.transform(features);
        let Work { plan, sample, power, .. } = &mut self.work;
        let starts = !self.taught || rate >= 1.0;
        let mut rate = rate;
        for (k, template) in self.templates.0.chunks_exact_mut(sample.len()).enumerate() {
            let is_first_frames = k == 0 && self.params.templates > 1;
            if starts {
                template.copy_from_slice(sample);
            } else if !is_first_frames {
                spectra::blend(template, sample, rate as f32);
                normalise(plan, template, power);
                rate *= SLOWER;
            }
        }
        self.taught = true;
        self.prepare();
    }

    fn series(&self) -> (&RealFft2, &[Complex32]) {
        (&self.work.plan, &self.work.series)
    }

    fn shape(&self) -> (Size, usize) {
        (self.grid, self.channels)
    }
}

#[cfg(test)]
mod tests {
    use super::reference::Dense;
    use super::*;
    use pursuit_testkit::SplitMix;

    const GRID: Size = Size::new(6, 5);
    const CHANNELS: usize = 3;

    fn noise(seed: u64) -> Planes {
        let mut numbers = SplitMix::after(seed);
        let mut planes = Planes::new(GRID, CHANNELS);
        planes.as_mut_slice().iter_mut().for_each(|v| *v = numbers.unit() as f32 - 0.5);
        planes
    }

    /// All channels moved to the right and down, around the border.
    fn moved(planes: &Planes, dx: usize, dy: usize) -> Planes {
        let mut out = planes.clone();
        for (from, to) in planes.planes().zip(out.planes_mut()) {
            for (k, v) in from.iter().enumerate() {
                let (x, y) = ((k % GRID.width + dx) % GRID.width, (k / GRID.width + dy) % GRID.height);
                to[y * GRID.width + x] = *v;
            }
        }
        out
    }

    fn taught(params: &SparseCodeParams) -> CirculantCoder {
        let mut coder = CirculantCoder::new(params.clone(), GRID, CHANNELS, 0.7);
        coder.learn(&noise(1), 1.0);
        coder.learn(&noise(2), 0.4);
        coder
    }

    fn coded(coder: &mut CirculantCoder, features: &Planes) -> Vec<f64> {
        coder.work.transform(features);
        coder.code();
        coder.work.codes.iter().copied().map(f64::from).collect()
    }

    /// The templates as planes of length one, by their definition.
    fn dense(params: &SparseCodeParams) -> Dense {
        let unit = |planes: &[f64]| {
            let length = planes.iter().map(|v| v * v).sum::<f64>().sqrt();
            planes.iter().map(|v| v / length).collect::<Vec<f64>>()
        };
        let of = |seed: u64| unit(&noise(seed).as_slice().iter().copied().map(f64::from).collect::<Vec<f64>>());
        let (first, second) = (of(1), of(2));
        let mix = |rate: f64| unit(&first.iter().zip(&second).map(|(a, b)| a + rate * (b - a)).collect::<Vec<f64>>());
        let templates = match params.templates {
            1 => vec![mix(0.4)],
            2 => vec![first.clone(), mix(0.4)],
            _ => vec![first.clone(), mix(0.4), mix(0.1)],
        };
        Dense::new(&templates, (GRID.width, GRID.height), CHANNELS)
    }

    fn sample() -> (Planes, Vec<f64>) {
        let mut planes = moved(&noise(2), 2, 3);
        planes.as_mut_slice().iter_mut().zip(noise(7).as_slice()).for_each(|(v, n)| *v += 0.3 * n);
        let values: Vec<f64> = planes.as_slice().iter().copied().map(f64::from).collect();
        let length = values.iter().map(|v| v * v).sum::<f64>().sqrt();
        (planes, values.iter().map(|v| v / length).collect())
    }

    #[test]
    fn codes_are_those_of_explicit_circulant_matrices() {
        for templates in 1..=3 {
            for iterations in [1, 2, 7] {
                let params = SparseCodeParams { templates, iterations, lambda: 0.03, ..SparseCodeParams::default() };
                let (planes, x) = sample();
                let got = coded(&mut taught(&params), &planes);
                let want = dense(&params).alternate(&x, params.lambda, params.penalty, iterations);
                for (got, want) in got.iter().zip(&want) {
                    assert!((got - want).abs() < 1e-4, "K = {templates}, {iterations}: {got} is not {want}");
                }
            }
        }
    }

    #[test]
    fn many_iterations_reach_the_least() {
        let params = SparseCodeParams { iterations: 500, lambda: 0.05, ..SparseCodeParams::default() };
        let (planes, x) = sample();
        let dense = dense(&params);
        let (got, want) = (coded(&mut taught(&params), &planes), dense.shrink(&x, params.lambda, 20_000));
        let (got, want) = (dense.objective(&x, &got, params.lambda), dense.objective(&x, &want, params.lambda));
        assert!((got - want).abs() < 1e-3 * want, "{got} is not {want}");
    }

    #[test]
    fn the_peak_is_the_shift() {
        let mut coder = taught(&SparseCodeParams::default());
        let mut response = vec![0.0; GRID.area()];
        for (dx, dy) in [(0, 0), (2, 1), (5, 4)] {
            coder.respond(&moved(&noise(1), dx, dy), &mut response);
            let peak = (0..response.len()).max_by(|a, b| response[*a].total_cmp(&response[*b])).unwrap();
            assert_eq!((peak % GRID.width, peak / GRID.width), (dx, dy));
            assert!(response[peak] > 0.4, "{}", response[peak]);
        }
        coder.respond(&Planes::new(GRID, CHANNELS), &mut response);
        assert!(response.iter().all(|v| v.abs() < 1e-6), "nothing is coded by nothing");
    }

    #[test]
    fn states_that_do_not_fit_are_refused() {
        let back = |c: &CirculantCoder| postcard::from_bytes::<CirculantCoder>(&postcard::to_stdvec(c).unwrap());
        let mut coder = taught(&SparseCodeParams::default());
        let mut again = back(&coder).unwrap();
        let (planes, _) = sample();
        assert_eq!(coded(&mut again, &planes), coded(&mut coder, &planes));
        coder.channels = 2;
        assert!(back(&coder).is_err());
        coder.channels = CHANNELS;
        coder.params.iterations = 1_000_000;
        assert!(back(&coder).is_err());
        coder.params.iterations = 8;
        coder.templates.0[3].re = f32::NAN;
        assert!(back(&coder).is_err());
    }
}
