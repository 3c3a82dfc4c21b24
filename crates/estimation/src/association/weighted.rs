//! Correction by several detections at once, each for its probability.

use nalgebra::{SMatrix, SVector};

use crate::error::require;
use crate::matrix::{require_finite, sandwich, symmetrise, times_vector};
use crate::sharp::corrected;
use crate::{EstimationError, Gaussian, LinearMeasurement, Result};

impl<const N: usize> Gaussian<N> {
    /// Corrects the belief by `values` of which at most one is of this target, with the `probabilities` of none and of each
    /// (one more than there are values, and their sum one): the probabilistic data association filter (Bar-Shalom and Li
    /// 1995, 3.4).
    ///
    /// `x + K ν̄` and `β₀ P + (1 − β₀) P⁺ + K (Σ βᵢ (νᵢ − ν̄)(νᵢ − ν̄)ᵀ + β₀ ν̄ ν̄ᵀ) Kᵀ`: a sum of positive terms.
    ///
    /// # Errors
    /// Where the lengths do not agree, probabilities are negative or do not sum to one (to 1e-9), a value is not finite, or
    /// the innovation covariance is singular; the belief is then as it was.
    pub fn update_weighted<const M: usize>(
        &mut self,
        measurement: &LinearMeasurement<M, N>,
        values: &[SVector<f64, M>],
        probabilities: &[f64],
    ) -> Result<()> {
        let (got, expected) = (probabilities.len(), values.len() + 1);
        let [missed, each @ ..] = probabilities else {
            return Err(EstimationError::Length { what: "probabilities of none and each value", got, expected });
        };
        if got != expected {
            return Err(EstimationError::Length { what: "probabilities of none and each value", got, expected });
        }
        self.update_shared(measurement, *missed, values.iter().copied().zip(each.iter().copied()))
    }

    /// The same of values with their probabilities that nobody need put into a list; none of them is this target's with the probability
    /// `missed`. `values` is gone through several times.
    ///
    /// # Errors
    /// As [`update_weighted`](Self::update_weighted).
    pub fn update_shared<const M: usize>(
        &mut self,
        measurement: &LinearMeasurement<M, N>,
        missed: f64,
        values: impl Iterator<Item = (SVector<f64, M>, f64)> + Clone,
    ) -> Result<()> {
        let mut sum = missed;
        require("a probability", missed, missed >= 0.0, "zero or more")?;
        let here = times_vector(measurement.matrix(), self.mean());
        let mut mean = SVector::<f64, M>::zeros();
        for (value, probability) in values.clone() {
            require("a probability", probability, probability >= 0.0, "zero or more")?;
            require_finite("the measurement", &value)?;
            sum += probability;
            mean += (value - here) * probability;
        }
        require("the sum of probabilities", sum, (sum - 1.0).abs() <= 1e-9, "one")?;
        let mut spread: SMatrix<f64, M, M> = mean * mean.transpose() * missed;
        for (value, probability) in values {
            let away = value - here - mean;
            spread += away * away.transpose() * probability;
        }
        let known = corrected(self, measurement, &mean)?;
        let mut covariance =
            self.covariance() * missed + known.belief.covariance() * (1.0 - missed) + sandwich(&known.gain, &spread);
        symmetrise(&mut covariance);
        *self = Self::computed(*known.belief.mean(), covariance)?;
        Ok(())
    }
}
