//! The noises of a track, from the track itself.
//!
//! Places are filtered under a constant acceleration disturbed by white jerk of intensity `q`, or a constant jerk disturbed by
//! white noise in its derivative, with measurements of variance `r` in pixels. Only the ratio `λ = q / r` shapes the filter; given it, the likelihood is greatest at `r = Σ ν² / n`, so that
//! one number is looked for, on a logarithmic scale and over its whole range. How likely the others are is kept: a short
//! track does not say for certain how agile its target is, and what is said of velocity and acceleration has to allow for
//! that.

use super::Place;
use nalgebra::{Matrix2, SMatrix, SVector, Vector2};
use pursuit_estimation::{Gaussian, LinearMeasurement, Result, Transition};

/// A step of the clock at which the belief is kept, and what was measured there.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tick {
    /// Time since the tick before, in steps of the track.
    pub dt: f64,
    /// What was measured, in pixels of the track's own size.
    pub seen: Option<Seen>,
    /// How many steps ago the velocity jumped, where it did since the tick before.
    pub jump: Option<f64>,
}

#[derive(Debug, Clone, Copy)]
pub(super) struct Seen {
    value: Vector2<f64>,
    /// What brings measurements to independent pixels; none where places are pixels but for one scale and a turn.
    whitened: Option<Matrix2<f64>>,
}

/// Places in pixels and steps: numbers near 1, whatever the unit.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scale {
    /// The ruler's unit in one pixel, at the middle of the track.
    pub length: f64,
    /// Seconds in one step: the median of them.
    pub step_s: f64,
}

impl Scale {
    pub fn seen(&self, place: &Place) -> Seen {
        let slope = place.slope / self.length;
        // A map that keeps angles keeps errors round.
        let (a, b) = (slope.column(0), slope.column(1));
        let round =
            a.dot(&b).abs() < 1e-9 && (a.norm_squared() - 1.0).abs() < 1e-9 && (b.norm_squared() - 1.0).abs() < 1e-9;
        let whitened = if round { None } else { slope.try_inverse() };
        Seen { value: place.at / self.length, whitened }
    }
}

/// Velocity and acceleration are unknown at first to this many pixels a step.
const UNKNOWN: f64 = 1e6;
/// What a jump leaves of what was known of the velocity, pixels a step.
const JUMP: f64 = 1e3;
/// Measurements that place, velocity, acceleration and jerk take to be known at all: left out of the likelihood, whichever of
/// both models it is of, so that they can be compared.
const FIRST: usize = 4;

/// What is summed over a track at one ratio.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sums {
    /// `Σ νᵀ S⁻¹ ν`.
    squares: f64,
    /// `Σ ln |S|`.
    logarithms: f64,
    /// How many numbers were measured, less those that the start and the jumps take.
    pub freedom: f64,
}

impl Sums {
    pub fn with(self, other: Self) -> Self {
        Self {
            squares: self.squares + other.squares,
            logarithms: self.logarithms + other.logarithms,
            freedom: self.freedom + other.freedom,
        }
    }

    /// The variance of a measurement in square pixels.
    pub fn variance(&self) -> f64 {
        (self.squares / self.freedom).max(LEAST_VARIANCE)
    }

    /// The logarithm of the likelihood, at that variance.
    pub fn log_likelihood(&self) -> f64 {
        -0.5 * (self.freedom * self.variance().ln() + self.squares / self.variance() + self.logarithms)
    }
}

/// Trajectories are written to a thousandth of a pixel: nothing is known better.
const LEAST_VARIANCE: f64 = 1e-6 / 12.0;

/// The filter's first pass. Beliefs are in pixels and steps, for a measurement variance of 1.
pub(super) struct Pass<const N: usize> {
    pub beliefs: Vec<Gaussian<N>>,
    pub steps: Vec<Transition<N>>,
    /// The residuals against the prediction, over their standard deviation at variance 1; in order of measurements.
    pub innovations: Vec<Option<Vector2<f64>>>,
}

/// A step of `N / 2` derivatives of x and y, the highest of which is disturbed by white noise of intensity `density` in its own
/// derivative: `F_ij = dtʲ⁻ⁱ / (j − i)!`, `Q_ij = q dt^(a+b+1) / (a! b! (a + b + 1))` with `a = K − 1 − i`, `b = K − 1 − j`
/// (Bar-Shalom, Li, Kirubarajan 2001, 6.2). [`Integrators`](pursuit_estimation::motion::Integrators) end at the third.
fn chain<const N: usize>(dt: f64, density: f64) -> Result<Transition<N>> {
    let k = N / 2;
    let factorial = |n: usize| (1..=n).product::<usize>() as f64;
    let mut matrix = SMatrix::<f64, N, N>::zeros();
    let mut noise = matrix;
    for i in 0..k {
        for j in 0..k {
            let (a, b) = (k - 1 - i, k - 1 - j);
            for axis in 0..2 {
                let at = (2 * i + axis, 2 * j + axis);
                if j >= i {
                    matrix[at] = dt.powi((j - i) as i32) / factorial(j - i);
                }
                noise[at] = density * dt.powi((a + b + 1) as i32) / (factorial(a) * factorial(b) * (a + b + 1) as f64);
            }
        }
    }
    Transition::new(matrix, noise)
}

/// Filters `ticks`, the first and the last of which were measured; `pass` is told of every belief.
pub(super) fn filter<const N: usize>(ticks: &[Tick], ratio: f64, mut pass: Option<&mut Pass<N>>) -> Result<Sums> {
    let direct = LinearMeasurement::<2, N>::select([0, 1], [1.0, 1.0])?;
    let mut sums = Sums::default();
    let mut belief = start(ticks)?;
    let (mut measured, mut last) = (0, None::<(f64, Transition<N>)>);
    for (k, tick) in ticks.iter().enumerate() {
        if k > 0 {
            let step = match last {
                Some((dt, step)) if dt == tick.dt && tick.jump.is_none() => step,
                _ => {
                    let step = chain::<N>(tick.dt, ratio)?;
                    last = Some((tick.dt, step));
                    tick.jump.map_or(Ok(step), |ago| jumping(&step, ago))?
                }
            };
            belief.predict(&step)?;
            if let Some(pass) = pass.as_deref_mut() {
                pass.steps.push(step);
            }
        }
        if tick.jump.is_some() {
            // Both axes of velocity, acceleration and whatever is above.
            sums.freedom -= N as f64 - 2.0;
        }
        if let Some(seen) = &tick.seen {
            let innovation = match &seen.whitened {
                None => belief.update(&direct, &seen.value)?,
                Some(white) => {
                    let mut matrix = SMatrix::<f64, 2, N>::zeros();
                    matrix.fixed_view_mut::<2, 2>(0, 0).copy_from(white);
                    let sensor = LinearMeasurement::new(matrix, Matrix2::identity())?;
                    belief.update(&sensor, &(white * seen.value))?
                }
            };
            measured += 1;
            let nis = innovation.nis();
            if measured > FIRST {
                sums.squares += nis;
                // ln |S| = −2 ln p − ν² − 2 ln 2π
                sums.logarithms += -2.0 * innovation.log_likelihood() - nis - 2.0 * std::f64::consts::TAU.ln();
                sums.freedom += 2.0;
            }
            if let Some(pass) = pass.as_deref_mut() {
                let deviation = innovation.covariance().diagonal().map(f64::sqrt);
                pass.innovations.push((measured > FIRST).then(|| innovation.residual().component_div(&deviation)));
            }
        }
        if let Some(pass) = pass.as_deref_mut() {
            pass.beliefs.push(belief);
        }
    }
    Ok(sums)
}

/// The belief before the first measurement: nothing is known.
fn start<const N: usize>(ticks: &[Tick]) -> Result<Gaussian<N>> {
    let first = ticks.iter().find_map(|t| t.seen).map_or(Vector2::zeros(), |seen| seen.value);
    let mean = SVector::from_fn(|i, _| if i < 2 { first[i] } else { 0.0 });
    let variance = UNKNOWN * UNKNOWN;
    Gaussian::from_variances(mean, SVector::repeat(variance))
}

/// A step in which the velocity jumped, `ago` steps before its end: what the jump adds is carried on from there.
fn jumping<const N: usize>(step: &Transition<N>, ago: f64) -> Result<Transition<N>> {
    let jump = SVector::<f64, N>::from_fn(|i, _| if i < 2 { 0.0 } else { JUMP * JUMP });
    let on = chain::<N>(ago.max(1e-6), 0.0)?;
    step.with_noise(step.noise() + on.matrix() * SMatrix::from_diagonal(&jump) * on.matrix().transpose())
}

/// What is likely of a model: ratios with their weights, which sum to 1, the likeliest first; and the logarithm of how likely the
/// model is itself, whatever its ratio.
pub(super) struct Likely {
    pub ratios: Vec<(f64, f64)>,
    pub evidence: f64,
}

/// The likely ratios of the model of `N` numbers.
pub(super) fn likely<const N: usize>(stretches: &[&[Tick]]) -> Result<Likely> {
    let sums = |log10: f64| -> Result<f64> {
        let all = stretches.iter().map(|ticks| filter::<N>(ticks, 10_f64.powf(log10), None));
        Ok(all.collect::<Result<Vec<_>>>()?.into_iter().fold(Sums::default(), Sums::with).log_likelihood())
    };
    let longest = stretches.iter().map(|t| t.iter().filter(|t| t.seen.is_some()).count()).max().unwrap_or(0) as f64;
    // Below this a polynomial fits as well as anything: its highest coefficient has the variance 720 / n⁵ (100800 / n⁷ of a
    // cubic), to which the noise adds n λ. Above 10⁴ every place is believed as it is measured.
    let lowest = if N == 6 { 72.0 / longest.powi(6) } else { 10_080.0 / longest.powi(8) };
    let range = (lowest.log10().max(-60.0), 4.0);
    let mut step = 1.0;
    let mut points = Vec::new();
    for i in 0..=((range.1 - range.0) / step).ceil() as usize {
        let at = range.0 + step * i as f64;
        points.push((at, sums(at)?));
    }
    loop {
        let best = best(&points);
        let beside =
            |side: f64| points.iter().find(|p| (p.0 - best.0 - side * step).abs() < 1e-9).map_or(0.0, |p| best.1 - p.1);
        if step < 0.02 || (beside(1.0) < 1.0 && beside(-1.0) < 1.0) {
            return Ok(weighed(points, best, step, range.1 - range.0));
        }
        step *= 0.5;
        // The half steps over what is likely.
        for k in -8..=8_i32 {
            let at = best.0 + f64::from(k) * step;
            if (range.0..=range.1).contains(&at) && points.iter().all(|p| (p.0 - at).abs() > 1e-9) {
                points.push((at, sums(at)?));
            }
        }
    }
}

fn best(points: &[(f64, f64)]) -> (f64, f64) {
    points.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0.0, 0.0))
}

/// The points on the grid of `step` around the best that are at all likely, as ratios with weights; before anything is seen
/// every ratio is as likely on the logarithmic scale over `width` decades.
fn weighed(mut points: Vec<(f64, f64)>, best: (f64, f64), step: f64, width: f64) -> Likely {
    const UNLIKELY: f64 = 6.0;
    points.retain(|p| {
        let steps = (p.0 - best.0) / step;
        (steps - steps.round()).abs() < 1e-6 && best.1 - p.1 < UNLIKELY
    });
    points.sort_by(|a, b| b.1.total_cmp(&a.1));
    let weights: Vec<f64> = points.iter().map(|p| (p.1 - best.1).exp()).collect();
    let sum: f64 = weights.iter().sum();
    let ratios = points.iter().zip(weights).map(|(p, w)| (10_f64.powf(p.0), w / sum)).collect();
    Likely { ratios, evidence: best.1 + (sum * step / width).ln() }
}
