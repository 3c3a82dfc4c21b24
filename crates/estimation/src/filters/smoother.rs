//! The Rauch-Tung-Striebel smoother, linear, extended and unscented: what was believed then, knowing what came after.

use nalgebra::SMatrix;

use crate::matrix::{cholesky, divide_by_factored, sandwich, times_transpose};
use crate::nonlinear::{LinearizedMotion, NonlinearMotion, Unscented};
use crate::{EstimationError, Gaussian, Result, Transition};

/// Smooths a filtered run in place (Rauch, Tung, Striebel 1965).
///
/// `filtered[k]` is the belief after the update at step `k`, and `transitions[k]` leads from step `k` to `k + 1`, so
/// there is one transition fewer than beliefs.
///
/// # Errors
/// Where the lengths do not agree or a predicted covariance is singular; the beliefs are then as they were.
pub fn smooth<const N: usize>(filtered: &mut [Gaussian<N>], transitions: &[Transition<N>]) -> Result<()> {
    require_steps(filtered.len(), transitions.len())?;
    let mut smoothed = filtered.to_vec();
    for (k, transition) in transitions.iter().enumerate().rev() {
        if let [now, next, ..] = &mut smoothed[k..] {
            *now = smoothed_by(now, transition, next)?;
        }
    }
    filtered.copy_from_slice(&smoothed);
    Ok(())
}

/// Smooths a run of the extended filter in place: [`smooth`] with the slopes of `motion` at the filtered means (Särkkä 2013,
/// algorithm 9.1). `dts_s[k]` is the time from belief `k` to `k + 1`, in seconds.
///
/// # Errors
/// As [`smooth`] and [`Gaussian::predict_extended`]; the beliefs are then as they were.
pub fn smooth_extended<const N: usize>(
    filtered: &mut [Gaussian<N>],
    motion: &impl LinearizedMotion<N>,
    dts_s: &[f64],
) -> Result<()> {
    let steps = filtered.iter().zip(dts_s).map(|(belief, dt_s)| belief.linearized_extended(motion, *dt_s));
    let steps: Vec<_> = require_steps(filtered.len(), dts_s.len()).and_then(|()| steps.collect())?;
    smooth(filtered, &steps)
}

/// Smooths a run of the unscented filter in place (Särkkä, IEEE Trans. AC 53, 2008). `dts_s[k]` is the time from belief `k`
/// to `k + 1`, in seconds.
///
/// # Errors
/// As [`smooth`] and [`Gaussian::linearized_unscented`]; the beliefs are then as they were.
pub fn smooth_unscented<const N: usize>(
    filtered: &mut [Gaussian<N>],
    motion: &impl NonlinearMotion<N>,
    dts_s: &[f64],
    unscented: &Unscented,
) -> Result<()> {
    let steps = filtered.iter().zip(dts_s).map(|(belief, dt_s)| belief.linearized_unscented(motion, *dt_s, unscented));
    let steps: Vec<_> = require_steps(filtered.len(), dts_s.len()).and_then(|()| steps.collect())?;
    smooth(filtered, &steps)
}

/// Refuses another number of steps than there are gaps between the beliefs.
fn require_steps(beliefs: usize, steps: usize) -> Result<()> {
    if steps + 1 == beliefs {
        return Ok(());
    }
    let expected = beliefs.saturating_sub(1);
    Err(EstimationError::Length { what: "steps between the beliefs to smooth", got: steps, expected })
}

/// The belief `now`, given the smoothed belief one step on: `C = P Fᵀ (P⁻)⁻¹`, `x + C (xˢ − x⁻)`,
/// `P + C (Pˢ − P⁻) Cᵀ`.
pub(super) fn smoothed_by<const N: usize>(
    now: &Gaussian<N>,
    transition: &Transition<N>,
    next: &Gaussian<N>,
) -> Result<Gaussian<N>> {
    let predicted = now.predicted(transition)?;
    let lower = cholesky(predicted.covariance()).map_err(|(row, pivot)| EstimationError::NotPositive {
        what: "a predicted covariance in the smoother",
        requirement: "positive definite",
        row,
        pivot,
    })?;
    let gain = divide_by_factored(&times_transpose(now.covariance(), transition.matrix()), &lower);
    // Joseph-like: (I − C F) P (I − C F)ᵀ + C (Pˢ + Q) Cᵀ is a sum of positive terms and equals P + C (Pˢ − P⁻) Cᵀ.
    let keep = SMatrix::<f64, N, N>::identity() - gain * transition.matrix();
    let covariance = sandwich(&keep, now.covariance()) + sandwich(&gain, &(next.covariance() + transition.noise()));
    Gaussian::computed(now.mean() + gain * (next.mean() - predicted.mean()), covariance)
}
