//! `zhai2024`, the filter's part: the motion noise of a particle filter by maximum likelihood, from how far the estimate
//! moved against what was predicted.

mod params;
mod particles;

pub use params::{VarianceParams, VarianceRule};
pub use particles::{LikelihoodNoiseFilter, bhattacharyya_coefficient, similarity_log_likelihood};

use nalgebra::SVector;

use crate::Result;
use crate::matrix::require_finite;
use params::LONGEST;

/// The running estimate of the variance of `M` independent residual components.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VarianceEstimate<const M: usize> {
    params: VarianceParams,
    count: usize,
    variance: SVector<f64, M>,
    /// Squares of the last residuals, a ring.
    recent: [SVector<f64, M>; LONGEST],
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
        self.count += 1;
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
