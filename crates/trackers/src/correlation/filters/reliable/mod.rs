//! The correlation filter with channel and spatial reliability (lukezic2017): the filter inside `csr-dcf`.
//!
//! Each channel has a filter h of its own, which is 0 outside of the target's cells m (section 3.2):
//!
//! ```text
//! ‖ĥ_c* ⊙ x̂ − ŷ‖²  +  λ/2 ‖h_m‖²,   h_c = h_m = m ⊙ h_m
//! ```
//!
//! solved by a few alternating directions (eqs. 9 to 12). How much a channel counts in the answer is how high its filter answers what
//! it was taught, times how far its highest peak now stands above its second (section 3.3).

#[cfg(test)]
mod reference;
#[cfg(test)]
mod tests;

use super::{ResponseFilter, Spectra, fits};
use crate::appearance::Support;
use crate::correlation::ReliabilityParams;
use multiversion::multiversion;
use pursuit_geometry::Size;
use pursuit_parameters::Parameters;
use pursuit_vision::fourier::{Complex32, FftScratch, RealFft2, gaussian_label, spectra};
use pursuit_vision::sampling::Planes;
use serde::{Deserialize, Serialize};

/// A filter for each channel, confined to the target's cells, and how much each channel is to be relied upon; see the [module](self).
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(remote = "ReliableFilter")]
pub struct ReliableFilter {
    params: ReliabilityParams,
    grid: Size,
    channels: usize,
    label_sigma: f64,
    /// ĥ, all channels one after the other.
    filter: Spectra,
    /// How reliable each channel was in learning; their sum is 1.
    reliability: Vec<f32>,
    /// m, 1 where the target is and 0 elsewhere.
    cells: Vec<f32>,
    taught: bool,
    #[serde(skip)]
    work: Work,
}

pursuit_estimation::checked!(ReliableFilter);

impl ReliableFilter {
    fn restored(self) -> Result<Self, &'static str> {
        let Self { grid, label_sigma, channels, .. } = self;
        if !fits(grid, channels, label_sigma, &self.filter) || self.reliability.len() != channels {
            return Err("its filter does not have the size of its grid");
        }
        if self.cells.len() != grid.area() || self.params.check_all().is_err() {
            return Err("its filter is confined to cells that are not there, or its settings are out of range");
        }
        Ok(Self { work: Work::new(grid, label_sigma), ..self })
    }
}

/// Plans and what is overwritten at every use.
#[derive(Debug, Clone)]
struct Work {
    plan: RealFft2,
    fft: FftScratch,
    /// ŷ.
    label: Vec<Complex32>,
    /// x̂ of one channel.
    sample: Vec<Complex32>,
    /// x̂ ⊙ ŷ*.
    goal: Vec<Complex32>,
    /// ĥ_c.
    free: Vec<Complex32>,
    /// ĥ_m.
    confined: Vec<Complex32>,
    /// l̂, the multiplier.
    dual: Vec<Complex32>,
    /// The answer of all channels.
    sum: Vec<Complex32>,
    plane: Vec<f32>,
    /// How reliable each channel was in this sample.
    now: Vec<f32>,
}

/// Of a grid of one cell: made anew for the filter's own.
impl Default for Work {
    fn default() -> Self {
        Self::new(Size::new(1, 1), 1.0)
    }
}

impl Work {
    fn new(grid: Size, label_sigma: f64) -> Self {
        let (plan, mut fft) = (RealFft2::new(grid.width, grid.height), FftScratch::default());
        let mut label = vec![Complex32::default(); plan.spectrum_len()];
        plan.forward(&gaussian_label(grid.width, grid.height, label_sigma, label_sigma), &mut label, &mut fft);
        let spectrum = || vec![Complex32::default(); label.len()];
        Self {
            sample: spectrum(),
            goal: spectrum(),
            free: spectrum(),
            confined: spectrum(),
            dual: spectrum(),
            sum: spectrum(),
            plane: vec![0.0; grid.area()],
            now: Vec::new(),
            fft,
            label,
            plan,
        }
    }

    /// ĥ_m of a channel whose sample lies in `sample`, from `last`, the filter of the frame before; without one from ridge regression
    /// over the whole window. It comes to lie in `confined`.
    fn solve(&mut self, params: &ReliabilityParams, cells: &[f32], last: Option<&[Complex32]>) {
        let Self { plan, fft, label, sample, goal, free, confined, dual, plane, .. } = self;
        let lambda = params.lambda as f32;
        for ((goal, x), y) in goal.iter_mut().zip(sample.iter()).zip(label.iter()) {
            *goal = x * y.conj();
        }
        match last {
            Some(last) => confined.copy_from_slice(last),
            None => {
                let ridge = sample.iter().zip(goal.iter()).map(|(x, goal)| goal / (x.norm_sqr() + lambda));
                confined.iter_mut().zip(ridge).for_each(|(h, ridge)| *h = ridge);
            }
        }
        plan.inverse(confined, plane, fft);
        keep(plane, cells, 1.0);
        plan.forward(plane, confined, fft);
        dual.fill(Complex32::default());
        let mut penalty = params.penalty as f32;
        for _ in 0..params.iterations {
            free_step(sample, goal, confined, dual, free, penalty);
            plan.inverse(free, plane, fft);
            // λ/(2D), D the number of cells.
            keep(plane, cells, 1.0 / (0.5 * lambda / cells.len() as f32 + penalty));
            plan.forward(plane, confined, fft);
            dual_step(confined, dual, free, penalty);
            penalty *= params.penalty_growth as f32;
        }
    }
}

/// `plane *= factor · cells`.
fn keep(plane: &mut [f32], cells: &[f32], factor: f32) {
    plane.iter_mut().zip(cells).for_each(|(v, cell)| *v *= factor * cell);
}

/// `free` becomes l̂ + μ ĥ_c, with ĥ_c = (x̂ ⊙ ŷ* + μ ĥ_m − l̂) / (x̂* ⊙ x̂ + μ): eq. 9, and what eq. 10 transforms back.
#[multiversion(targets("x86_64+avx2+fma", "aarch64+neon"))]
fn free_step(
    sample: &[Complex32],
    goal: &[Complex32],
    confined: &[Complex32],
    dual: &[Complex32],
    free: &mut [Complex32],
    penalty: f32,
) {
    let given = sample.iter().zip(goal).zip(confined.iter().zip(dual));
    for (free, ((x, goal), (h, l))) in free.iter_mut().zip(given) {
        let share = penalty / (x.re * x.re + x.im * x.im + penalty);
        free.re = l.re + share * (goal.re + penalty * h.re - l.re);
        free.im = l.im + share * (goal.im + penalty * h.im - l.im);
    }
}

/// l̂ becomes l̂ + μ (ĥ_c − ĥ_m): eq. 11. `free` has l̂ + μ ĥ_c.
#[multiversion(targets("x86_64+avx2+fma", "aarch64+neon"))]
fn dual_step(confined: &[Complex32], dual: &mut [Complex32], free: &[Complex32], penalty: f32) {
    for ((l, free), h) in dual.iter_mut().zip(free).zip(confined) {
        l.re = free.re - penalty * h.re;
        l.im = free.im - penalty * h.im;
    }
}

/// The highest value of a plane that wraps around, and the highest of its other local peaks; the latter is 0 where none is above.
fn two_peaks(plane: &[f32], width: usize) -> (f32, f32) {
    let height = plane.len() / width.max(1);
    let (mut first, mut second) = (f32::NEG_INFINITY, 0.0_f32);
    for y in 0..height {
        let rows = [(y + height - 1) % height, y, (y + 1) % height].map(|y| &plane[y * width..(y + 1) * width]);
        for x in 0..width {
            let value = rows[1][x];
            // What is below the second changes neither.
            if value <= second && value <= first {
                continue;
            }
            let columns = [(x + width - 1) % width, x, (x + 1) % width];
            if rows.iter().all(|row| columns.iter().all(|&x| row[x] <= value)) {
                if value > first {
                    second = second.max(first);
                    first = value;
                } else {
                    second = second.max(value);
                }
            }
        }
    }
    (first, second)
}

impl ReliableFilter {
    /// An untaught filter on `channels` planes of `grid` cells, for a target of `target` cells (width, height) in the middle,
    /// with a Gaussian label of `label_sigma` cells.
    pub fn new(params: ReliabilityParams, grid: Size, channels: usize, target: (f64, f64), label_sigma: f64) -> Self {
        let work = Work::new(grid, label_sigma);
        Self {
            params,
            grid,
            channels,
            label_sigma,
            filter: Spectra(vec![Complex32::default(); work.label.len() * channels]),
            reliability: vec![1.0 / channels.max(1) as f32; channels],
            cells: Support::middle(target, grid).cells(grid),
            taught: false,
            work,
        }
    }

    /// The plane of the grid that is 1 in the cells that are learnt from.
    #[cfg(test)]
    pub(in crate::correlation) fn cells(&self) -> &[f32] {
        &self.cells
    }

    /// How reliable each channel was in learning: ≥ 0, their sum is 1.
    pub fn reliability(&self) -> &[f32] {
        &self.reliability
    }
}

impl ResponseFilter for ReliableFilter {
    fn respond(&mut self, features: &Planes, response: &mut [f32]) {
        let Work { plan, fft, sample, free, sum, plane, .. } = &mut self.work;
        let (bins, mut whole) = (sample.len(), 0.0);
        sum.fill(Complex32::default());
        let channels = features.planes().zip(self.filter.0.chunks_exact(bins)).zip(&self.reliability);
        for ((features, filter), learnt) in channels {
            plan.forward(features, sample, fft);
            free.fill(Complex32::default());
            spectra::add_conj_product(free, filter, sample);
            let mut weight = *learnt;
            if self.params.distinct {
                plan.inverse(free, plane, fft);
                let (first, second) = two_peaks(plane, self.grid.width);
                // A channel without any peak says nothing that could be relied upon.
                weight *= if first > 0.0 { 1.0 - (second / first).min(0.5) } else { 0.0 };
            }
            whole += weight;
            sum.iter_mut().zip(free.iter()).for_each(|(sum, answer)| *sum += answer * weight);
        }
        if whole > 0.0 {
            sum.iter_mut().for_each(|sum| *sum /= whole);
        }
        plan.inverse(sum, response, fft);
    }

    fn learn(&mut self, features: &Planes, rate: f64) {
        let rate = if self.taught { rate as f32 } else { 1.0 };
        let work = &mut self.work;
        let bins = work.label.len();
        work.now.clear();
        for (features, filter) in features.planes().zip(self.filter.0.chunks_exact_mut(bins)) {
            work.plan.forward(features, &mut work.sample, &mut work.fft);
            let last = (rate < 1.0).then_some(&*filter);
            work.solve(&self.params, &self.cells, last);
            work.free.fill(Complex32::default());
            spectra::add_conj_product(&mut work.free, &work.confined, &work.sample);
            work.plan.inverse(&work.free, &mut work.plane, &mut work.fft);
            work.now.push(work.plane.iter().copied().fold(0.0, f32::max));
            spectra::blend(filter, &work.confined, rate);
        }
        let whole: f32 = work.now.iter().sum();
        if whole > 0.0 && whole.is_finite() {
            let rate = if rate < 1.0 { self.params.rate as f32 } else { 1.0 };
            let shares = work.now.iter().map(|now| now / whole);
            self.reliability.iter_mut().zip(shares).for_each(|(old, now)| *old += rate * (now - *old));
        }
        self.taught = true;
    }

    fn series(&self) -> (&RealFft2, &[Complex32]) {
        (&self.work.plan, &self.work.sum)
    }

    fn shape(&self) -> (Size, usize) {
        (self.grid, self.channels)
    }

    fn confine(&mut self, cells: &[f32]) {
        if Support::of(cells, self.grid).is_some() {
            self.cells.copy_from_slice(cells);
        }
    }
}
