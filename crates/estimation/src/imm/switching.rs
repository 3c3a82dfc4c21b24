//! How likely a target is to change its way of moving.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use crate::error::{require, require_time_step};
use crate::matrix::require_finite;
use crate::{EstimationError, Result};

/// Sums of probabilities may differ from one by this much.
const SUM_TOLERANCE: f64 = 1e-9;

/// Refuses numbers that are not a probability distribution.
pub(super) fn require_distribution(name: &'static str, values: &[f64]) -> Result<()> {
    for &value in values {
        require(name, value, value >= 0.0, "zero or more")?;
    }
    let sum: f64 = values.iter().sum();
    require("the sum of mode probabilities", sum, (sum - 1.0).abs() <= SUM_TOLERANCE, "one")
}

/// The probabilities `π_ij` that a target in mode `i` is in mode `j` after one step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(remote = "Switching", transparent)]
pub struct Switching<const K: usize> {
    matrix: SMatrix<f64, K, K>,
}

crate::checked!([const K: usize] Switching<K>);

impl<const K: usize> Switching<K> {
    fn restored(self) -> Result<Self> {
        Self::per_step(self.matrix)
    }
}

impl<const K: usize> Switching<K> {
    /// The matrix with row `i` the distribution of the next mode given mode `i`.
    ///
    /// # Errors
    /// Where an entry is negative or not finite, or a row does not sum to one (to 1e-9).
    pub fn per_step(matrix: SMatrix<f64, K, K>) -> Result<Self> {
        for row in matrix.row_iter() {
            let values: [f64; K] = std::array::from_fn(|j| row[j]);
            require_distribution("a switching probability", &values)?;
        }
        Ok(Self { matrix })
    }

    /// `π`, row = from, column = to.
    pub const fn matrix(&self) -> &SMatrix<f64, K, K> {
        &self.matrix
    }
}

/// Switching in continuous time: mode `i` lasts `mean_s[i]` seconds on average and then gives way to any other mode
/// with equal chance. Unlike a per-step matrix it means the same at every frame rate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "RawSojourn<K>", into = "RawSojourn<K>")]
pub struct Sojourn<const K: usize> {
    mean_s: SVector<f64, K>,
    generator: SMatrix<f64, K, K>,
}

/// What is stored: the mean durations.
#[derive(Clone, Serialize, Deserialize)]
#[serde(rename = "Sojourn")]
struct RawSojourn<const K: usize>(SVector<f64, K>);

impl<const K: usize> From<Sojourn<K>> for RawSojourn<K> {
    fn from(sojourn: Sojourn<K>) -> Self {
        Self(sojourn.mean_s)
    }
}

impl<const K: usize> TryFrom<RawSojourn<K>> for Sojourn<K> {
    type Error = EstimationError;

    fn try_from(raw: RawSojourn<K>) -> Result<Self> {
        Self::new(raw.0.into())
    }
}

impl<const K: usize> Sojourn<K> {
    /// Switching with the mean durations `mean_s` of the modes, in seconds.
    ///
    /// # Errors
    /// Where a duration is not positive and finite.
    pub fn new(mean_s: [f64; K]) -> Result<Self> {
        let mut generator = SMatrix::<f64, K, K>::zeros();
        for (i, mean) in mean_s.into_iter().enumerate() {
            require("the mean duration of a mode in seconds", mean, mean > 0.0, "positive")?;
            if K > 1 {
                for j in 0..K {
                    generator[(i, j)] = if i == j { -1.0 / mean } else { 1.0 / (mean * (K - 1) as f64) };
                }
            }
        }
        require_finite("the rate of mode switching", &generator)?;
        Ok(Self { mean_s: SVector::from(mean_s), generator })
    }

    /// The mean durations of the modes, in seconds.
    pub const fn mean_s(&self) -> &SVector<f64, K> {
        &self.mean_s
    }

    /// The switching probabilities over a step of `dt_s` seconds: `exp(G dt)` of the generator `G`.
    ///
    /// # Errors
    /// Where `dt_s` is not positive and finite.
    pub fn over(&self, dt_s: f64) -> Result<Switching<K>> {
        require_time_step(dt_s)?;
        let scaled = self.generator * dt_s;
        require_finite("the rate of mode switching", &scaled)?;
        // Uniformisation: with the largest rate λ, exp(G) = exp(−λ) exp(λI + G), a series of positive terms only, so
        // that no probability comes out negative. Steps are halved until λ ≤ 1/2, then the result is squared.
        let fastest = (0..K).map(|i| -scaled[(i, i)]).fold(0.0, f64::max);
        let halvings = (2.0 * fastest).log2().ceil().clamp(0.0, 1000.0) as i32;
        let shrink = 0.5_f64.powi(halvings);
        let shifted = scaled * shrink + SMatrix::<f64, K, K>::identity() * (fastest * shrink);
        let mut term = SMatrix::<f64, K, K>::identity();
        let mut sum = term;
        for n in 1..=16 {
            term = term * shifted / f64::from(n);
            sum += term;
        }
        // Normalising the rows takes the place of the factor exp(−λ), and keeps rounding from growing in the squares.
        normalise_rows(&mut sum);
        for _ in 0..halvings {
            sum *= sum;
            normalise_rows(&mut sum);
        }
        Switching::per_step(sum)
    }
}

fn normalise_rows<const K: usize>(matrix: &mut SMatrix<f64, K, K>) {
    for mut row in matrix.row_iter_mut() {
        let total: f64 = row.iter().sum();
        row /= total;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_modes_follow_the_closed_form() {
        // Symmetric chain: P(stay) = (1 + exp(−2 dt / τ)) / 2.
        let chain = Sojourn::new([2.0, 2.0]).unwrap();
        for dt in [1e-6, 0.03, 1.0, 10.0, 1e3, 1e9] {
            let stay = chain.over(dt).unwrap().matrix()[(0, 0)];
            assert!((stay - 0.5 * (1.0 + (-dt).exp())).abs() < 1e-12, "dt {dt}: {stay}");
        }
    }

    #[test]
    fn steps_compose() {
        let chain = Sojourn::new([0.5, 3.0, 1.2]).unwrap();
        let (half, whole) = (chain.over(0.2).unwrap(), chain.over(0.4).unwrap());
        assert!((half.matrix() * half.matrix() - whole.matrix()).norm() < 1e-14);
    }

    #[test]
    fn what_is_not_a_distribution_is_refused() {
        assert!(Switching::per_step(SMatrix::<f64, 2, 2>::new(0.9, 0.2, 0.1, 0.9)).is_err());
        assert!(Switching::per_step(SMatrix::<f64, 2, 2>::new(1.1, -0.1, 0.1, 0.9)).is_err());
        assert!(Sojourn::new([1.0, 0.0]).is_err());
    }
}
