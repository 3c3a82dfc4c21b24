//! One Gaussian for several.

use nalgebra::{SMatrix, SVector};

use crate::matrix::{is_finite, symmetrise};
use crate::{EstimationError, Gaussian, Result};

/// Mean and covariance of a mixture of beliefs; `weights` sum to one.
pub(super) fn mixture<const N: usize, const K: usize>(
    beliefs: &[Gaussian<N>; K],
    weights: &SVector<f64, K>,
) -> Gaussian<N> {
    let mut mean = SVector::<f64, N>::zeros();
    for (belief, weight) in beliefs.iter().zip(weights.iter()) {
        mean += belief.mean() * *weight;
    }
    let mut covariance = SMatrix::<f64, N, N>::zeros();
    for (belief, weight) in beliefs.iter().zip(weights.iter()) {
        let away = belief.mean() - mean;
        for c in 0..N {
            let weighted = away[c] * weight;
            for r in 0..N {
                covariance[(r, c)] += belief.covariance()[(r, c)] * weight + away[r] * weighted;
            }
        }
    }
    symmetrise(&mut covariance);
    Gaussian::trusted(mean, covariance)
}

/// Means and variances below this cannot overflow a mixture.
const SAFE: f64 = 1e150;

/// Refuses beliefs whose mixture overflows.
#[inline]
pub(super) fn require_finite_mixture<const N: usize, const K: usize>(
    beliefs: &[Gaussian<N>; K],
    weights: &SVector<f64, K>,
) -> Result<()> {
    if beliefs.iter().all(|belief| belief.mean().amax() < SAFE && belief.covariance().trace() < SAFE) {
        return Ok(());
    }
    let whole = mixture(beliefs, weights);
    if is_finite(whole.mean()) && is_finite(whole.covariance()) {
        Ok(())
    } else {
        Err(EstimationError::Overflow { what: "the mixture of the modes" })
    }
}

/// `source` with the components that it lacks and `own` has taken from `own`, uncorrelated with the rest.
pub(super) fn filled<const N: usize>(
    source: &Gaussian<N>,
    source_holds: &[bool; N],
    own: &Gaussian<N>,
    own_holds: &[bool; N],
) -> Gaussian<N> {
    let from_own: [bool; N] = std::array::from_fn(|k| own_holds[k] && !source_holds[k]);
    let mean = SVector::from_fn(|r, _| if from_own[r] { own.mean()[r] } else { source.mean()[r] });
    let covariance = SMatrix::from_fn(|r, c| match (from_own[r], from_own[c]) {
        (true, true) => own.covariance()[(r, c)],
        (false, false) => source.covariance()[(r, c)],
        _ => 0.0,
    });
    Gaussian::trusted(mean, covariance)
}
