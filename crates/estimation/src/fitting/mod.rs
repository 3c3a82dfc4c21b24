//! Noise and switching found from recorded tracks, by maximum likelihood: the parameters under which a filter was least
//! surprised by what was measured.
//!
//! ```
//! use pursuit_estimation::fitting::{LinearFilter, Recording, fit};
//! use pursuit_estimation::motion::ConstantVelocity;
//! use pursuit_estimation::nalgebra::SVector;
//!
//! # fn main() -> pursuit_estimation::Result<()> {
//! # let readings: Vec<f64> = (0..60).map(|k| 3.0 * k as f64 + (1.7 * k as f64).sin()).collect();
//! let times_s = (0..60).map(|k| k as f64 / 30.0).collect();
//! let values = readings.iter().map(|x| Some(SVector::<f64, 1>::new(*x))).collect();
//! let tracks = [Recording::new(times_s, values)?];
//! // Density of the acceleration and variance of the position, from a first guess of both.
//! let found = fit(&tracks, [1.0, 1.0], |&[density, variance]| {
//!     LinearFilter::new(ConstantVelocity::<1>::white(density), variance, [1e4])
//! })?;
//! assert!(found.parameters[1] < 2.0);
//! # Ok(())
//! # }
//! ```

mod candidates;
mod simplex;

pub use candidates::{ImmFilter, LinearFilter};

use nalgebra::{SMatrix, SVector};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::error::{require, require_time_step};
use crate::matrix::require_finite;
use crate::{EstimationError, Result};

/// A recorded track: times in seconds, rising, and what was measured at each; `None` where nothing was.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(remote = "Recording")]
pub struct Recording<const M: usize> {
    times_s: Vec<f64>,
    values: Vec<Option<SVector<f64, M>>>,
}

crate::checked!([const M: usize] Recording<M>);

impl<const M: usize> Recording<M> {
    fn restored(self) -> Result<Self> {
        Self::new(self.times_s, self.values)
    }
}

impl<const M: usize> Recording<M> {
    /// A track of `values` measured at `times_s`.
    ///
    /// # Errors
    /// Where the lengths differ, times do not rise, a number is not finite or nothing was measured at all.
    pub fn new(times_s: Vec<f64>, values: Vec<Option<SVector<f64, M>>>) -> Result<Self> {
        let (got, expected) = (values.len(), times_s.len());
        if got != expected {
            return Err(EstimationError::Length { what: "values of a track, one for each time", got, expected });
        }
        if values.iter().flatten().next().is_none() {
            return Err(EstimationError::Length { what: "measurements in a track", got: 0, expected: 1 });
        }
        for value in values.iter().flatten() {
            require_finite("a measurement of a track", value)?;
        }
        if !times_s.iter().all(|time_s| time_s.is_finite()) {
            return Err(EstimationError::NotFinite { what: "a time of a track" });
        }
        for pair in times_s.windows(2) {
            require_time_step(pair[1] - pair[0])?;
        }
        Ok(Self { times_s, values })
    }

    /// How surprising the track is to `filter`: the logarithm of the density of all measurements after the first, which it
    /// is started from.
    ///
    /// # Errors
    /// Those of the filter.
    pub fn log_likelihood(&self, filter: &mut impl Candidate<M>) -> Result<f64> {
        let mut sum = 0.0;
        let mut last_s = None;
        for (&time_s, value) in self.times_s.iter().zip(&self.values) {
            match (last_s, value) {
                (None, None) => continue,
                (None, Some(first)) => filter.start(first)?,
                (Some(before_s), _) => {
                    filter.predict(time_s - before_s)?;
                    if let Some(value) = value {
                        sum += filter.update(value)?;
                    }
                }
            }
            last_s = Some(time_s);
        }
        Ok(sum)
    }
}

/// A filter with its parameters set, to be tried on recorded tracks.
pub trait Candidate<const M: usize> {
    /// Starts anew at a first measurement.
    ///
    /// # Errors
    /// Where the filter cannot be started there.
    fn start(&mut self, first: &SVector<f64, M>) -> Result<()>;

    /// Moves on by `dt_s` seconds.
    ///
    /// # Errors
    /// Those of the filter.
    fn predict(&mut self, dt_s: f64) -> Result<()>;

    /// Takes a measurement in and returns the logarithm of its likelihood before that.
    ///
    /// # Errors
    /// Those of the filter.
    fn update(&mut self, value: &SVector<f64, M>) -> Result<f64>;
}

/// What a fit found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit<const P: usize> {
    /// The most likely parameters.
    pub parameters: [f64; P],
    /// Standard deviations of their logarithms (relative errors, where small) by the curvature of the likelihood; `None`
    /// where that has no maximum there: a parameter that the tracks say nothing about.
    pub deviations: Option<[f64; P]>,
    /// The logarithm of the likelihood.
    pub log_likelihood: f64,
    /// How often the tracks were filtered.
    pub evaluations: usize,
}

/// The positive parameters under which the filters that `build` makes explain all `tracks` best, looked for from `guess` on.
///
/// By the simplex method (Nelder and Mead 1965) on the parameters' logarithms, started again from what it found until that
/// stays. Parameters that `build` refuses are as good as impossible. A local search: where the likelihood has several
/// maxima, as that of interacting models may, try several guesses. Tracks are filtered on all cores; the answer does not
/// depend on how many.
///
/// # Errors
/// Where there are no tracks, a guess is not positive, the filter fails at the guess, or the search does not settle.
pub fn fit<const M: usize, const P: usize, F: Candidate<M>>(
    tracks: &[Recording<M>],
    guess: [f64; P],
    build: impl Fn(&[f64; P]) -> Result<F> + Sync,
) -> Result<Fit<P>> {
    if tracks.is_empty() {
        return Err(EstimationError::Length { what: "tracks to fit to", got: 0, expected: 1 });
    }
    for value in guess {
        require("a guess", value, value > 0.0, "positive")?;
    }
    let likelihood = |logarithms: &SVector<f64, P>| -> Result<f64> {
        let parameters: [f64; P] = logarithms.map(f64::exp).into();
        let each: Result<Vec<f64>> =
            tracks.par_iter().map(|track| track.log_likelihood(&mut build(&parameters)?)).collect();
        Ok(each?.iter().sum())
    };
    let start = SVector::from(guess).map(f64::ln);
    likelihood(&start)?;
    let cost = |x: &SVector<f64, P>| {
        likelihood(x).map_or(f64::INFINITY, |value| if value.is_nan() { f64::INFINITY } else { -value })
    };
    let found = simplex::minimise(cost, start)?;
    Ok(Fit {
        parameters: found.at.map(f64::exp).into(),
        deviations: deviations(cost, &found.at, found.least),
        log_likelihood: -found.least,
        evaluations: found.evaluations + 1,
    })
}

/// Roots of the diagonal of the inverse of the cost's second derivatives, by differences.
fn deviations<const P: usize>(
    cost: impl Fn(&SVector<f64, P>) -> f64,
    at: &SVector<f64, P>,
    least: f64,
) -> Option<[f64; P]> {
    const STEP: f64 = 0.05;
    let shifted = |i: usize, a: f64, j: usize, b: f64| {
        let mut x = *at;
        x[i] += a * STEP;
        x[j] += b * STEP;
        cost(&x)
    };
    let mut curvature = SMatrix::<f64, P, P>::zeros();
    for i in 0..P {
        for j in 0..=i {
            let value = if i == j {
                shifted(i, 1.0, i, 0.0) + shifted(i, -1.0, i, 0.0) - 2.0 * least
            } else {
                let same = shifted(i, 1.0, j, 1.0) + shifted(i, -1.0, j, -1.0);
                0.25 * (same - shifted(i, 1.0, j, -1.0) - shifted(i, -1.0, j, 1.0))
            };
            curvature[(i, j)] = value / (STEP * STEP);
            curvature[(j, i)] = curvature[(i, j)];
        }
    }
    let lower = crate::matrix::cholesky(&curvature).ok()?;
    let inverse = crate::matrix::divide_by_factored(&SMatrix::<f64, P, P>::identity(), &lower);
    Some(std::array::from_fn(|i| inverse[(i, i)].sqrt()))
}
