//! `zhai2024`, the filter's part: the motion noise of a particle filter by maximum likelihood, from how far the estimate
//! moved against what was predicted.

mod params;
mod particles;

pub use params::{VarianceParams, VarianceRule};
pub use particles::{LikelihoodNoiseFilter, bhattacharyya_coefficient, similarity_log_likelihood};

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

use crate::error::require;
use crate::matrix::require_finite;
use crate::{EstimationError, Result};
use params::LONGEST;

/// The running estimate of the variance of `M` independent residual components.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Raw<M>", into = "Raw<M>")]
pub struct VarianceEstimate<const M: usize> {
    params: VarianceParams,
    count: usize,
    variance: SVector<f64, M>,
    /// Squares of the last residuals, a ring.
    recent: [SVector<f64, M>; LONGEST],
}

/// What is stored: read back through the same checks as any outside input.
#[derive(Clone, Serialize, Deserialize)]
#[serde(rename = "VarianceEstimate")]
struct Raw<const M: usize> {
    params: VarianceParams,
    count: usize,
    variance: SVector<f64, M>,
    recent: Vec<SVector<f64, M>>,
}

impl<const M: usize> From<VarianceEstimate<M>> for Raw<M> {
    fn from(it: VarianceEstimate<M>) -> Self {
        Self { params: it.params, count: it.count, variance: it.variance, recent: it.recent.to_vec() }
    }
}

impl<const M: usize> TryFrom<Raw<M>> for VarianceEstimate<M> {
    type Error = EstimationError;

    fn try_from(raw: Raw<M>) -> Result<Self> {
        raw.params.validate()?;
        for &value in raw.recent.iter().flatten().chain(raw.variance.iter()) {
            require("a variance learnt", value, value >= 0.0, "zero or more")?;
        }
        let recent = <[_; LONGEST]>::try_from(raw.recent).map_err(|given: Vec<_>| EstimationError::Length {
            what: "residuals kept",
            got: given.len(),
            expected: LONGEST,
        })?;
        Ok(Self { params: raw.params, count: raw.count, variance: raw.variance, recent })
    }
}

impl<const M: usize> VarianceEstimate<M> {
    /// An estimate that has seen nothing yet.
    ///
    /// # Errors
    /// Where a parameter is out of range.
    pub fn new(params: VarianceParams) -> Result<Self> {
        params.validate()?;
        Ok(Self { params, count: 0, variance: SVector::zeros(), recent: [SVector::zeros(); LONGEST] })
    }

    /// Takes in one residual `r_k = Y_k − X_k` and returns the variances as now known.
    ///
    /// # Errors
    /// Where the residual is not finite; nothing is learnt then.
    pub fn observe(&mut self, residual: &SVector<f64, M>) -> Result<SVector<f64, M>> {
        require_finite("the residual", residual)?;
        let square = residual.component_mul(residual);
        self.recent[self.count % LONGEST] = square;
        self.count = self.count.saturating_add(1);
        let k = self.count as f64;
        self.variance = match self.params.rule {
            VarianceRule::Corrected => self.variance * ((k - 1.0) / k) + square / k,
            VarianceRule::Printed => (self.variance + square) * ((k - 1.0) / k),
            VarianceRule::Exponential { .. } if self.count == 1 => square,
            VarianceRule::Exponential { weight } => self.variance * (1.0 - weight) + square * weight,
            VarianceRule::Window { length } => {
                let used = length.min(self.count);
                let sum: SVector<f64, M> = (1..=used).map(|back| self.recent[(self.count - back) % LONGEST]).sum();
                sum / used as f64
            }
        };
        Ok(self.variance())
    }

    /// The variances, within floor and cap; the floor before the first residual.
    pub fn variance(&self) -> SVector<f64, M> {
        self.variance.map(|value| value.max(self.params.floor).min(self.params.cap))
    }

    /// How many residuals were taken in.
    pub const fn count(&self) -> usize {
        self.count
    }
}
