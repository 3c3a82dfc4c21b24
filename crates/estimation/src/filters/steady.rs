//! The gain a filter settles on, from the discrete algebraic Riccati equation.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use crate::correction::joseph;
use crate::matrix::{cholesky, divide_by_factored, is_finite, require_finite, sandwich, times_transpose};
use crate::{EstimationError, Gaussian, LinearMeasurement, Result, Transition};

/// The limit of a time-invariant Kalman filter: covariance before and after the update, and the gain between them.
///
/// As a filter of its own ([`step`](Self::step)) it costs two matrix-vector products: the α-β and α-β-γ filters are
/// this, in one dimension.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Raw<M, N>", into = "Raw<M, N>")]
pub struct SteadyState<const M: usize, const N: usize> {
    transition: Transition<N>,
    measurement: LinearMeasurement<M, N>,
    /// `P⁻`, the covariance of the one-step prediction.
    pub prior_covariance: SMatrix<f64, N, N>,
    /// `P⁺`, the covariance after the update.
    pub posterior_covariance: SMatrix<f64, N, N>,
    /// `K`, the gain.
    pub gain: SMatrix<f64, N, M>,
}

/// What is stored: the model. Its steady state is solved for again, which gives the same numbers.
#[derive(Clone, Serialize, Deserialize)]
#[serde(rename = "SteadyState")]
struct Raw<const M: usize, const N: usize> {
    transition: Transition<N>,
    measurement: LinearMeasurement<M, N>,
}

impl<const M: usize, const N: usize> From<SteadyState<M, N>> for Raw<M, N> {
    fn from(steady: SteadyState<M, N>) -> Self {
        Self { transition: steady.transition, measurement: steady.measurement }
    }
}

impl<const M: usize, const N: usize> TryFrom<Raw<M, N>> for SteadyState<M, N> {
    type Error = EstimationError;

    fn try_from(raw: Raw<M, N>) -> Result<Self> {
        Self::solve(&raw.transition, &raw.measurement)
    }
}

/// Doublings cover 2⁶⁰ steps: what has not settled then never will.
const DOUBLINGS: usize = 60;
/// Riccati steps allowed where doubling does not apply (a perfect sensor).
const STEPS: usize = 100_000;
/// Relative change that counts as settled.
const SETTLED: f64 = 1e-15;

impl<const M: usize, const N: usize> SteadyState<M, N> {
    /// The steady state of the filter with this transition and sensor.
    ///
    /// By structured doubling (Chu et al. 2005), which squares the number of filter steps in every iteration; where `R`
    /// is singular, by the Riccati recursion itself.
    ///
    /// # Errors
    /// Where the recursion does not settle (the state is not detectable, or noise leaves a mode marginal), or an
    /// innovation covariance is singular.
    pub fn solve(transition: &Transition<N>, measurement: &LinearMeasurement<M, N>) -> Result<Self> {
        let start = match cholesky(measurement.noise()) {
            Ok(factor) => doubled(transition, measurement, &factor)?,
            Err(_) => SMatrix::identity(),
        };
        let mut belief = Gaussian::computed(SVector::zeros(), start)?;
        let mut smallest = f64::INFINITY;
        let mut stalled = 0;
        for _ in 0..STEPS {
            let posterior = updated(&belief, measurement)?;
            let next = Gaussian::computed(
                SVector::zeros(),
                sandwich(transition.matrix(), posterior.covariance()) + transition.noise(),
            )?;
            let change = (next.covariance() - belief.covariance()).norm() / next.covariance().norm();
            belief = next;
            // Rounding leaves a floor that differs from model to model: settled is also "no longer shrinking".
            stalled = if change < 0.5 * smallest { 0 } else { stalled + 1 };
            smallest = smallest.min(change);
            if change <= SETTLED || (stalled > 50 && smallest < 1e-12) {
                return Ok(Self {
                    transition: *transition,
                    measurement: *measurement,
                    prior_covariance: *belief.covariance(),
                    posterior_covariance: *updated(&belief, measurement)?.covariance(),
                    gain: belief.gain(measurement)?,
                });
            }
        }
        Err(EstimationError::NoConvergence { what: "the Riccati recursion", iterations: STEPS })
    }

    /// Moves `state` by one step and corrects it by `value` with the steady gain.
    ///
    /// Returns the prediction made before the correction.
    ///
    /// # Errors
    /// Where `value` is not finite; the state is then as it was.
    pub fn step(&self, state: &mut SVector<f64, N>, value: &SVector<f64, M>) -> Result<SVector<f64, N>> {
        require_finite("the measurement", value)?;
        let prior = self.transition.matrix() * *state + self.transition.offset();
        let next = prior + self.gain * (value - self.measurement.matrix() * prior);
        if !is_finite(&next) {
            return Err(EstimationError::Overflow { what: "the new state" });
        }
        *state = next;
        Ok(prior)
    }

    /// The covariances `(before, after)` the update that this fixed gain really gives on a target whose process noise is
    /// `truth_noise`, not the one it was designed for: zero for a target that moves without noise.
    ///
    /// # Errors
    /// Where `(I − K H) F` is not stable.
    pub fn error_on(&self, truth_noise: &SMatrix<f64, N, N>) -> Result<(SMatrix<f64, N, N>, SMatrix<f64, N, N>)> {
        let keep = SMatrix::<f64, N, N>::identity() - self.gain * self.measurement.matrix();
        let drive = sandwich(&keep, truth_noise) + sandwich(&self.gain, self.measurement.noise());
        // Smith's doubling of the Lyapunov equation P = A P Aᵀ + W.
        let mut power = keep * self.transition.matrix();
        let mut posterior = drive;
        for _ in 0..DOUBLINGS {
            let more = sandwich(&power, &posterior);
            posterior += more;
            power *= power;
            if !is_finite(&posterior) {
                break;
            }
            if more.norm() <= 1e-17 * posterior.norm() {
                return Ok((sandwich(self.transition.matrix(), &posterior) + truth_noise, posterior));
            }
        }
        Err(EstimationError::NoConvergence { what: "the fixed gain's error covariance", iterations: DOUBLINGS })
    }
}

/// The belief after an update by the value it expects.
fn updated<const M: usize, const N: usize>(
    belief: &Gaussian<N>,
    measurement: &LinearMeasurement<M, N>,
) -> Result<Gaussian<N>> {
    let gain = belief.gain(measurement)?;
    joseph(belief, measurement, &SVector::zeros(), &gain)
}

/// `P⁻` by structured doubling: with `A = Fᵀ`, `G = Hᵀ R⁻¹ H`, `P = Q`,
/// `W = (I + G P)⁻¹`, `A ← A W A`, `G ← G + A W G Aᵀ`, `P ← P + Aᵀ P W A`.
fn doubled<const M: usize, const N: usize>(
    transition: &Transition<N>,
    measurement: &LinearMeasurement<M, N>,
    noise_factor: &SMatrix<f64, M, M>,
) -> Result<SMatrix<f64, N, N>> {
    let mut a = transition.matrix().transpose();
    let weighted = divide_by_factored(&measurement.matrix().transpose(), noise_factor);
    let mut g = times_transpose(&weighted, &measurement.matrix().transpose());
    let mut p = *transition.noise();
    let failed = EstimationError::NoConvergence { what: "structured doubling", iterations: DOUBLINGS };
    for _ in 0..DOUBLINGS {
        let w = (SMatrix::<f64, N, N>::identity() + g * p).try_inverse().ok_or_else(|| failed.clone())?;
        let more = a.transpose() * p * w * a;
        let next_g = g + a * w * g * a.transpose();
        a = a * w * a;
        p += (more + more.transpose()) * 0.5;
        g = (next_g + next_g.transpose()) * 0.5;
        if !is_finite(&p) {
            return Err(failed);
        }
        if more.norm() <= SETTLED * p.norm() {
            return Ok(p);
        }
    }
    Err(failed)
}
