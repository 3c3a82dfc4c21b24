//! The interacting multiple model estimator (Blom and Bar-Shalom 1988): several motion models over one state, each
//! with its own belief, mixed at every step by the probability that the target switched from one to another.

mod switching;

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

pub use switching::{Sojourn, Switching};

use crate::matrix::symmetrise;
use crate::{EstimationError, Gaussian, Innovation, LinearMeasurement, Result, Transition};

/// `K` beliefs over the same `N`-component state, one per motion model, and the probability of each.
///
/// A step is [`predict`](Self::predict), then [`update`](Self::update) where there is a measurement; without one the
/// modes keep their predicted probabilities.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Raw<N>", into = "Raw<N>")]
pub struct Imm<const N: usize, const K: usize> {
    beliefs: [Gaussian<N>; K],
    probabilities: SVector<f64, K>,
}

/// What is stored: arrays of generic length are vectors in serde.
#[derive(Clone, Serialize, Deserialize)]
#[serde(rename = "Imm")]
struct Raw<const N: usize> {
    beliefs: Vec<Gaussian<N>>,
    probabilities: Vec<f64>,
}

impl<const N: usize, const K: usize> From<Imm<N, K>> for Raw<N> {
    fn from(imm: Imm<N, K>) -> Self {
        Self { beliefs: imm.beliefs.to_vec(), probabilities: imm.probabilities.as_slice().to_vec() }
    }
}

impl<const N: usize, const K: usize> TryFrom<Raw<N>> for Imm<N, K> {
    type Error = EstimationError;

    fn try_from(raw: Raw<N>) -> Result<Self> {
        let wrong = |got| EstimationError::Length { what: "the number of modes", got, expected: K };
        let beliefs = <[Gaussian<N>; K]>::try_from(raw.beliefs).map_err(|given| wrong(given.len()))?;
        let probabilities = <[f64; K]>::try_from(raw.probabilities).map_err(|given| wrong(given.len()))?;
        Self::from_beliefs(beliefs, probabilities)
    }
}

impl<const N: usize, const K: usize> Imm<N, K> {
    /// An estimator whose modes all start from `belief`, with the given prior probability of each mode.
    ///
    /// # Errors
    /// Where the probabilities are negative or do not sum to one (to 1e-9).
    pub fn new(belief: Gaussian<N>, probabilities: [f64; K]) -> Result<Self> {
        Self::from_beliefs([belief; K], probabilities)
    }

    /// An estimator with a belief of its own for each mode.
    ///
    /// # Errors
    /// Where the probabilities are negative or do not sum to one (to 1e-9).
    pub fn from_beliefs(beliefs: [Gaussian<N>; K], probabilities: [f64; K]) -> Result<Self> {
        let probabilities = SVector::from(probabilities);
        switching::require_distribution("a mode probability", probabilities.as_slice())?;
        Ok(Self { beliefs, probabilities })
    }

    /// The belief of each mode.
    pub const fn beliefs(&self) -> &[Gaussian<N>; K] {
        &self.beliefs
    }

    /// The probability of each mode; sums to one.
    pub const fn probabilities(&self) -> &SVector<f64, K> {
        &self.probabilities
    }

    /// The belief of the whole: mean and covariance of the mixture.
    pub fn combined(&self) -> Gaussian<N> {
        mixture(&self.beliefs, &self.probabilities)
    }

    /// Mixes the modes by `switching`, then moves each belief by its own transition.
    ///
    /// # Errors
    /// Where a result overflows; the estimator is then as it was.
    pub fn predict(&mut self, transitions: &[Transition<N>; K], switching: &Switching<K>) -> Result<()> {
        let chances = switching.matrix();
        let mut beliefs = self.beliefs;
        let mut predicted = SVector::<f64, K>::zeros();
        for j in 0..K {
            // μ_{i|j} c_j = π_ij μ_i
            let joint = SVector::<f64, K>::from_fn(|i, _| chances[(i, j)] * self.probabilities[i]);
            predicted[j] = joint.sum();
            // A mode that cannot be reached keeps its own belief: its weight is zero in every mixture.
            if predicted[j] > 0.0 {
                beliefs[j] = mixture(&self.beliefs, &(joint / predicted[j]));
            }
            beliefs[j].predict(&transitions[j])?;
        }
        *self = Self { beliefs, probabilities: predicted / predicted.sum() };
        Ok(())
    }

    /// What a measurement says against the belief of each mode, without correcting it.
    ///
    /// # Errors
    /// As [`Gaussian::innovation`].
    pub fn innovations<const M: usize>(
        &self,
        measurement: &LinearMeasurement<M, N>,
        value: &SVector<f64, M>,
    ) -> Result<[Innovation<M>; K]> {
        let first = self.beliefs.first().ok_or(EstimationError::Length { what: "modes", got: 0, expected: 1 })?;
        let mut out = [first.innovation(measurement, value)?; K];
        for (slot, belief) in out.iter_mut().zip(&self.beliefs).skip(1) {
            *slot = belief.innovation(measurement, value)?;
        }
        Ok(out)
    }

    /// Corrects every mode by the measurement and weighs the modes by its likelihood under each.
    ///
    /// Returns the log-likelihood of the measurement under the mixture of the modes.
    ///
    /// # Errors
    /// As [`Gaussian::update`]; the estimator is then as it was.
    pub fn update<const M: usize>(
        &mut self,
        measurement: &LinearMeasurement<M, N>,
        value: &SVector<f64, M>,
    ) -> Result<f64> {
        self.update_each(&[*measurement; K], value)
    }

    /// [`update`](Self::update) with a sensor model of its own for each mode.
    ///
    /// # Errors
    /// As [`Gaussian::update`]; the estimator is then as it was.
    pub fn update_each<const M: usize>(
        &mut self,
        measurements: &[LinearMeasurement<M, N>; K],
        value: &SVector<f64, M>,
    ) -> Result<f64> {
        let mut beliefs = self.beliefs;
        let mut log_weights = SVector::<f64, K>::zeros();
        for j in 0..K {
            let innovation = beliefs[j].update(&measurements[j], value)?;
            log_weights[j] = innovation.log_likelihood() + self.probabilities[j].ln();
        }
        // Weighed by logarithms: a measurement far from every mode must not leave 0/0.
        let highest = log_weights.max();
        let weights = log_weights.map(|value| (value - highest).exp());
        let total = weights.sum();
        *self = Self { beliefs, probabilities: weights / total };
        Ok(highest + total.ln())
    }
}

/// Mean and covariance of a mixture of beliefs; `weights` sum to one.
fn mixture<const N: usize, const K: usize>(beliefs: &[Gaussian<N>; K], weights: &SVector<f64, K>) -> Gaussian<N> {
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
