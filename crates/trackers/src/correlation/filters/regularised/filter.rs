use super::solve::{Weights, confine, keep, ridge_bins, scale, solve_bins, subtract_from};
use crate::appearance::Support;
use crate::correlation::SolverParams;
use crate::correlation::filters::{ResponseFilter, Spectra, fits};
use pursuit_geometry::Size;
use pursuit_parameters::Parameters;
use pursuit_vision::fourier::{Complex32, FftScratch, RealFft2, gaussian_label, spectra};
use pursuit_vision::sampling::Planes;
use serde::{Deserialize, Serialize};

/// A filter of the target's size, trained on every shift over a much larger window; see the [module](super).
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(remote = "RegularisedFilter")]
pub struct RegularisedFilter {
    solver: SolverParams,
    grid: Size,
    channels: usize,
    /// The rectangle that holds the cells.
    support: Support,
    /// The cells the filter is confined to are 1, the others 0.
    cells: Vec<f32>,
    label_sigma: f64,
    /// f, all channels one after the other.
    filter: Spectra,
    /// The sample trained on, a running average.
    model: Spectra,
    taught: bool,
    #[serde(skip)]
    work: Work,
}

pursuit_estimation::checked!(RegularisedFilter);

impl RegularisedFilter {
    fn restored(self) -> Result<Self, &'static str> {
        let Self { grid, label_sigma, channels, support, .. } = self;
        if !fits(grid, channels, label_sigma, &self.filter) || self.model.0.len() != self.filter.0.len() {
            return Err("its filter does not have the size of its grid");
        }
        let Support { left, right, top, bottom } = support;
        let within = left < right && right <= grid.width && top < bottom && bottom <= grid.height;
        if !within || self.cells.len() != grid.area() {
            return Err("its filter is confined to cells that are not there");
        }
        if self.solver.check_all().is_err() {
            return Err("its solver has impossible settings");
        }
        Ok(Self { work: Work::new(grid, channels, label_sigma), ..self })
    }
}

/// Plans and scratch; not state.
#[derive(Debug, Clone)]
struct Work {
    plan: RealFft2,
    fft: FftScratch,
    label: Vec<Complex32>,
    sample: Vec<Complex32>,
    target: Vec<Complex32>,
    /// h, where there are more than two iterations.
    dual: Vec<f32>,
    plane: Vec<f32>,
    power: Vec<f32>,
    dots: Vec<Complex32>,
}

/// Of a grid of one cell: made anew for the filter's own.
impl Default for Work {
    fn default() -> Self {
        Self::new(Size::new(1, 1), 1, 1.0)
    }
}

impl Work {
    fn new(grid: Size, channels: usize, label_sigma: f64) -> Self {
        let plan = RealFft2::new(grid.width, grid.height);
        let (bins, zero, mut fft) = (plan.spectrum_len(), Complex32::default(), FftScratch::default());
        let mut label = vec![zero; bins];
        plan.forward(&gaussian_label(grid.width, grid.height, label_sigma, label_sigma), &mut label, &mut fft);
        scale(&mut label, unit(grid));
        Self {
            fft,
            label,
            sample: vec![zero; bins * channels],
            target: vec![zero; bins * channels],
            dual: Vec::new(),
            plane: vec![0.0; grid.area()],
            power: vec![0.0; bins],
            dots: vec![zero; bins],
            plan,
        }
    }

    /// The spectra of `features`, scaled.
    fn transform(&mut self, features: &Planes) {
        let bins = self.plan.spectrum_len();
        for (plane, out) in features.planes().zip(self.sample.chunks_exact_mut(bins)) {
            self.plan.forward(plane, out, &mut self.fft);
        }
        scale(&mut self.sample, unit(self.plan.size()));
    }
}

/// Makes the transform keep energies.
fn unit(grid: Size) -> f32 {
    1.0 / (grid.area().max(1) as f32).sqrt()
}

impl RegularisedFilter {
    /// An untaught filter on `channels` planes of `grid` cells, for a target of `target` cells (width, height) in the middle,
    /// with a Gaussian label of `label_sigma` cells.
    pub fn new(solver: SolverParams, grid: Size, channels: usize, target: (f64, f64), label_sigma: f64) -> Self {
        let work = Work::new(grid, channels, label_sigma);
        let zero = vec![Complex32::default(); work.sample.len()];
        let support = Support::middle(target, grid);
        Self {
            solver,
            grid,
            channels,
            support,
            cells: support.cells(grid),
            label_sigma,
            filter: Spectra(zero.clone()),
            model: Spectra(zero),
            taught: false,
            work,
        }
    }

    /// The rectangle that holds the cells the filter is confined to.
    pub const fn support(&self) -> Support {
        self.support
    }
}

impl ResponseFilter for RegularisedFilter {
    fn respond(&mut self, features: &Planes, response: &mut [f32]) {
        self.work.transform(features);
        let Work { plan, fft, sample, dots, .. } = &mut self.work;
        let bins = plan.spectrum_len();
        dots.fill(Complex32::default());
        for (f, x) in self.filter.0.chunks_exact(bins).zip(sample.chunks_exact(bins)) {
            spectra::add_conj_product(dots, f, x);
        }
        scale(dots, 1.0 / unit(self.grid));
        plan.inverse(dots, response, fft);
    }

    /// The first call teaches from nothing; later ones stay near the last filter, even with a rate of 1.
    fn learn(&mut self, features: &Planes, rate: f64) {
        self.work.transform(features);
        let Work { plan, fft, label, sample, target, dual, plane, power, dots } = &mut self.work;
        let (bins, model, settings) = (plan.spectrum_len(), &mut self.model.0, &self.solver);
        spectra::blend(model, sample, if self.taught { rate as f32 } else { 1.0 });
        power.fill(0.0);
        model.chunks_exact(bins).for_each(|x| spectra::add_power(power, x));

        dual.clear();
        if settings.iterations > 2 {
            dual.resize(plane.len() * self.channels, 0.0);
        }
        let mut penalty = settings.penalty as f32;
        let temporal = if self.taught { settings.temporal_weight as f32 } else { 0.0 };
        for iteration in 1.. {
            if iteration == 1 && temporal == 0.0 {
                ridge_bins(model, label, target, power, dots, penalty);
            } else {
                if iteration == 1 {
                    target.fill(Complex32::default());
                }
                solve_bins(model, label, &self.filter.0, target, power, dots, Weights { temporal, penalty });
            }
            if iteration >= settings.iterations {
                break;
            }
            let inside = penalty / (penalty + settings.spatial_weight as f32);
            let rescale = (1.0 / settings.penalty_growth) as f32;
            if settings.iterations == 2 {
                // h is 0 before the step and nobody asks for it afterwards: g − h = (1 + r)·g − r·f, and g has few rows.
                let rows = self.support.top..self.support.bottom;
                let inner = rows.start * self.grid.width..rows.end * self.grid.width;
                for spectrum in target.chunks_exact_mut(bins) {
                    plan.inverse_rows(spectrum, plane, rows.clone(), fft);
                    keep(&mut plane[inner.clone()], &self.cells[inner.clone()], inside * (1.0 + rescale));
                    plan.forward_rows(plane, rows.clone(), dots, fft);
                    subtract_from(dots, rescale, spectrum);
                }
            } else {
                for (spectrum, dual) in target.chunks_exact_mut(bins).zip(dual.chunks_exact_mut(plane.len())) {
                    plan.inverse(spectrum, plane, fft);
                    confine(plane, dual, &self.cells, inside, rescale);
                    plan.forward(plane, spectrum, fft);
                }
            }
            penalty *= settings.penalty_growth as f32;
        }
        std::mem::swap(&mut self.filter.0, target);
        self.taught = true;
    }

    fn series(&self) -> (&RealFft2, &[Complex32]) {
        (&self.work.plan, &self.work.dots)
    }

    fn shape(&self) -> (Size, usize) {
        (self.grid, self.channels)
    }

    fn confine(&mut self, cells: &[f32]) {
        if let Some(support) = Support::of(cells, self.grid) {
            self.support = support;
            self.cells.copy_from_slice(cells);
        }
    }

    /// The label's energy does not depend on the grid, so that its peak does.
    fn peak_unit(&self) -> f64 {
        (self.grid.area() as f64).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::super::reference::Reference;
    use super::*;
    use pursuit_testkit::SplitMix;

    const GRID: Size = Size::new(12, 10);
    const SETTINGS: SolverParams =
        SolverParams { temporal_weight: 0.7, spatial_weight: 0.2, penalty: 0.5, penalty_growth: 4.0, iterations: 3 };

    fn noise(seed: u64) -> Planes {
        let mut numbers = SplitMix::after(seed);
        let mut planes = Planes::new(GRID, 3);
        planes.as_mut_slice().iter_mut().for_each(|v| *v = numbers.unit() as f32 - 0.5);
        planes
    }

    fn doubles(planes: &Planes) -> Vec<Vec<f64>> {
        planes.planes().map(|p| p.iter().copied().map(f64::from).collect()).collect()
    }

    #[test]
    fn equals_dense_algebra_over_two_updates() {
        for iterations in 1..=3 {
            compare_with_dense_algebra(SolverParams { iterations, ..SETTINGS });
            compare_with_dense_algebra(SolverParams { iterations, temporal_weight: 0.0, ..SETTINGS });
        }
    }

    fn compare_with_dense_algebra(settings: SolverParams) {
        let mut filter = RegularisedFilter::new(settings.clone(), GRID, 3, (4.0, 4.0), 0.8);
        let label = gaussian_label(GRID.width, GRID.height, 0.8, 0.8).into_iter().map(f64::from).collect();
        let reference = Reference {
            width: GRID.width,
            label,
            temporal: settings.temporal_weight,
            spatial: settings.spatial_weight,
            penalty: settings.penalty,
            growth: settings.penalty_growth,
            iterations: settings.iterations,
        };
        let Support { left, right, top, bottom } = filter.support();
        assert_eq!((left, right, top, bottom), (4, 8, 3, 7));
        let inside = |x: usize, y: usize| (left..right).contains(&x) && (top..bottom).contains(&y);
        let (a, b, rate) = (noise(1), noise(2), 0.3);
        let mixed: Vec<Vec<f64>> = doubles(&a)
            .iter()
            .zip(doubles(&b))
            .map(|(a, b)| a.iter().zip(b).map(|(a, b)| a + rate * (b - a)).collect())
            .collect();
        let first = reference.train(&doubles(&a), None, inside);
        let second = reference.train(&mixed, Some(&first), inside);

        let mut response = vec![0.0; GRID.area()];
        for (step, slow) in [(&a, &first), (&b, &second)] {
            filter.learn(step, rate);
            filter.respond(&noise(3), &mut response);
            let want = reference.respond(slow, &doubles(&noise(3)));
            let scale = want.iter().fold(0.0f64, |m, v| m.max(v.abs()));
            for (got, want) in response.iter().zip(&want) {
                assert!((f64::from(*got) - want).abs() < 1e-4 * scale, "{got} is not {want}");
            }
        }
    }

    #[test]
    fn a_confined_filter_answers_its_sample_with_labels() {
        let settings =
            SolverParams { temporal_weight: 0.0, spatial_weight: 0.0, penalty: 0.01, iterations: 6, ..SETTINGS };
        let mut filter = RegularisedFilter::new(settings, GRID, 3, (6.0, 6.0), 0.8);
        filter.learn(&noise(4), 1.0);
        let mut response = vec![0.0; GRID.area()];
        filter.respond(&noise(4), &mut response);
        let (peak, rest) = (response[0], response[1..].iter().copied().fold(0.0, f32::max));
        assert!(peak > 0.5 && rest < 0.5 * peak, "{peak} {rest}");
        let (work, support) = (&mut filter.work, filter.support);
        let (mut inside, mut outside) = (0.0, 0.0);
        for spectrum in filter.filter.0.chunks_exact(work.plan.spectrum_len()) {
            work.plan.inverse(spectrum, &mut work.plane, &mut work.fft);
            for (i, v) in work.plane.iter().enumerate() {
                let (x, y) = (i % GRID.width, i / GRID.width);
                let kept = (support.left..support.right).contains(&x) && (support.top..support.bottom).contains(&y);
                *(if kept { &mut inside } else { &mut outside }) += v * v;
            }
        }
        assert!(outside < 0.02 * inside, "{outside} outside, {inside} inside");
    }

    #[test]
    fn states_that_do_not_fit_are_refused() {
        let mut filter = RegularisedFilter::new(SETTINGS, GRID, 3, (4.0, 4.0), 0.8);
        let back = |f: &RegularisedFilter| postcard::from_bytes::<RegularisedFilter>(&postcard::to_stdvec(f).unwrap());
        assert_eq!(back(&filter).unwrap().shape(), (GRID, 3));
        filter.channels = 2;
        assert!(back(&filter).is_err());
        filter.channels = 3;
        filter.support.right = GRID.width + 1;
        assert!(back(&filter).is_err());
        filter.support.right = filter.support.left;
        assert!(back(&filter).is_err());
        filter.support.right = GRID.width;
        filter.solver.iterations = 1000;
        assert!(back(&filter).is_err());
        filter.solver.iterations = 2;
        assert!(back(&filter).is_ok());
        filter.filter.0.pop();
        assert!(back(&filter).is_err());
    }
}
