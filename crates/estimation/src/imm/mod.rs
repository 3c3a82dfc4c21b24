//! The interacting multiple model estimator (Blom and Bar-Shalom 1988): several motion models over one state, each
//! with its own belief, mixed at every step by the probability that the target switched from one to another.

mod embedding;
mod mixing;
mod mode;
mod switching;

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

pub use embedding::Embedded;
pub use mode::{Extended, Mode, UnscentedMode};
pub use switching::{Sojourn, Switching};

use crate::nonlinear::{LinearizedSensor, NonlinearSensor, Unscented};
use crate::{EstimationError, Gaussian, Innovation, LinearMeasurement, Result, Transition};
use mixing::{filled, mixture};

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
    /// Where the probabilities are negative or do not sum to one (to 1e-9), or the beliefs are so far apart that the
    /// covariance of their mixture overflows.
    pub fn from_beliefs(beliefs: [Gaussian<N>; K], probabilities: [f64; K]) -> Result<Self> {
        let probabilities = SVector::from(probabilities);
        switching::require_distribution("a mode probability", probabilities.as_slice())?;
        mixing::require_finite_mixture(&beliefs, &probabilities)?;
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
        self.mixed(
            switching,
            |_, beliefs, weights| mixture(beliefs, weights),
            |j, belief| belief.predict(&transitions[j]),
        )
    }

    /// Mixes the modes by `switching`, then moves each over `dt_s` seconds in its own way, by whatever filter that needs:
    /// linear, extended, unscented, or of a smaller state ([`Embedded`]).
    ///
    /// What a smaller mode does not know, a larger one does not ask it: in the mixture for a mode, components that another
    /// one lacks are filled in with the mode's own (unbiased mixing: Yuan, Bar-Shalom, Willett et al., IEEE Trans. AES 48,
    /// 2012). With the zeros of the smaller state in their place an acceleration would be pulled to zero at every step.
    ///
    /// # Errors
    /// As [`Mode::predict`]; the estimator is then as it was.
    pub fn predict_modes(&mut self, modes: &[&dyn Mode<N>; K], switching: &Switching<K>, dt_s: f64) -> Result<()> {
        let holds = modes.map(|mode| mode.holds());
        if holds.iter().flatten().all(|held| *held) {
            return self.mixed(
                switching,
                |_, beliefs, weights| mixture(beliefs, weights),
                |j, belief| {
                    *belief = modes[j].predict(belief, dt_s)?;
                    Ok(())
                },
            );
        }
        let mix = |j: usize, beliefs: &[Gaussian<N>; K], weights: &SVector<f64, K>| {
            let own = &beliefs[j];
            let sources = std::array::from_fn(|i| filled(&beliefs[i], &holds[i], own, &holds[j]));
            mixture(&sources, weights)
        };
        self.mixed(switching, mix, |j, belief| {
            *belief = modes[j].predict(belief, dt_s)?;
            Ok(())
        })
    }

    /// Mixes the modes by `switching`, each by `mix` (mode, beliefs, weights), and moves each by `step`.
    fn mixed(
        &mut self,
        switching: &Switching<K>,
        mix: impl Fn(usize, &[Gaussian<N>; K], &SVector<f64, K>) -> Gaussian<N>,
        mut step: impl FnMut(usize, &mut Gaussian<N>) -> Result<()>,
    ) -> Result<()> {
        let chances = switching.matrix();
        let mut beliefs = self.beliefs;
        let mut predicted = SVector::<f64, K>::zeros();
        for j in 0..K {
            // μ_{i|j} c_j = π_ij μ_i
            let joint = SVector::<f64, K>::from_fn(|i, _| chances[(i, j)] * self.probabilities[i]);
            predicted[j] = joint.sum();
            // A mode that cannot be reached keeps its own belief: its weight is zero in every mixture.
            if predicted[j] > 0.0 {
                beliefs[j] = mix(j, &self.beliefs, &(joint / predicted[j]));
            }
            step(j, &mut beliefs[j])?;
        }
        self.commit(beliefs, predicted / predicted.sum())
    }

    /// Takes over what a step came to, if the mixture of it is finite: means far apart overflow their spread.
    fn commit(&mut self, beliefs: [Gaussian<N>; K], probabilities: SVector<f64, K>) -> Result<()> {
        mixing::require_finite_mixture(&beliefs, &probabilities)?;
        *self = Self { beliefs, probabilities };
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
        self.update_with(|j, belief| Ok(belief.update(&measurements[j], value)?.log_likelihood()))
    }

    /// [`update`](Self::update) by a nonlinear sensor, linearised at the mean of each mode.
    ///
    /// # Errors
    /// As [`Gaussian::update_extended`]; the estimator is then as it was.
    pub fn update_extended<const M: usize>(
        &mut self,
        sensor: &impl LinearizedSensor<M, N>,
        value: &SVector<f64, M>,
    ) -> Result<f64> {
        self.update_with(|_, belief| Ok(belief.update_extended(sensor, value)?.log_likelihood()))
    }

    /// [`update`](Self::update) by a nonlinear sensor, through sigma points of each mode.
    ///
    /// # Errors
    /// As [`Gaussian::update_unscented`]; the estimator is then as it was.
    pub fn update_unscented<const M: usize>(
        &mut self,
        sensor: &impl NonlinearSensor<M, N>,
        value: &SVector<f64, M>,
        shape: &Unscented,
    ) -> Result<f64> {
        self.update_with(|_, belief| Ok(belief.update_unscented(sensor, value, shape)?.log_likelihood()))
    }

    /// Corrects every mode by `correct` (its number and belief), which returns the logarithm of the measurement's
    /// likelihood, and weighs the modes by that. Returns the log-likelihood under the mixture of the modes.
    ///
    /// # Errors
    /// Where `correct` fails, a likelihood is NaN or infinite, or the measurement is impossible under every mode
    /// ([`EstimationError::Impossible`]: its distance overflows); the estimator is then as it was.
    pub fn update_with(&mut self, mut correct: impl FnMut(usize, &mut Gaussian<N>) -> Result<f64>) -> Result<f64> {
        let mut beliefs = self.beliefs;
        let mut log_weights = SVector::<f64, K>::zeros();
        for j in 0..K {
            log_weights[j] = correct(j, &mut beliefs[j])? + self.probabilities[j].ln();
        }
        let highest = log_weights.max();
        if log_weights.iter().any(|value| value.is_nan() || *value == f64::INFINITY) {
            return Err(EstimationError::Overflow { what: "the likelihood of a mode" });
        }
        // Where the distance to every mode overflows there is nothing left to weigh them by.
        if highest == f64::NEG_INFINITY {
            return Err(EstimationError::Impossible { hypothesis: "mode" });
        }
        // Weighed by logarithms: a measurement far from every mode must not leave 0/0.
        let weights = log_weights.map(|value| (value - highest).exp());
        let total = weights.sum();
        self.commit(beliefs, weights / total)?;
        Ok(highest + total.ln())
    }
}
