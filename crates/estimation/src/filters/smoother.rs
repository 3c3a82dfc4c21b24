//! The Rauch-Tung-Striebel smoother: what was believed then, knowing what came after.

use crate::matrix::{cholesky, divide_by_factored, sandwich, times_transpose};
use crate::{EstimationError, Gaussian, Result, Transition};

/// Smooths a filtered run in place (Rauch, Tung, Striebel 1965).
///
/// `filtered[k]` is the belief after the update at step `k`, and `transitions[k]` leads from step `k` to `k + 1`, so
/// there is one transition fewer than beliefs.
///
/// # Errors
/// Where the lengths do not agree or a predicted covariance is singular; the beliefs are then as they were.
pub fn smooth<const N: usize>(filtered: &mut [Gaussian<N>], transitions: &[Transition<N>]) -> Result<()> {
    if transitions.len() + 1 != filtered.len() {
        return Err(EstimationError::Length {
            what: "transitions between the beliefs to smooth",
            got: transitions.len(),
            expected: filtered.len().saturating_sub(1),
        });
    }
    let mut smoothed = filtered.to_vec();
    for (k, transition) in transitions.iter().enumerate().rev() {
        if let [now, next, ..] = &mut smoothed[k..] {
            *now = smoothed_by(now, transition, next)?;
        }
    }
    filtered.copy_from_slice(&smoothed);
    Ok(())
}

/// The belief `now`, given the smoothed belief one step on: `C = P Fᵀ (P⁻)⁻¹`, `x + C (xˢ − x⁻)`,
/// `P + C (Pˢ − P⁻) Cᵀ`.
fn smoothed_by<const N: usize>(
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
    let keep = nalgebra::SMatrix::<f64, N, N>::identity() - gain * transition.matrix();
    let covariance = sandwich(&keep, now.covariance()) + sandwich(&gain, &(next.covariance() + transition.noise()));
    Gaussian::computed(now.mean() + gain * (next.mean() - predicted.mean()), covariance)
}
