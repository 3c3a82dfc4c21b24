//! Measurements with outliers: noise of Student's t in place of a Gaussian's.

use nalgebra::SVector;

use crate::error::require;
use crate::matrix::{cholesky, divide_by_factored, mahalanobis_squared, require_finite, sandwich, times_vector};
use crate::sharp::corrected;
use crate::{EstimationError, Gaussian, Innovation, LinearMeasurement, Result};

/// Rounds after which the weight is taken as it is; few are needed but for outliers at the edge.
const ROUNDS: usize = 50;
/// Change of the weight that counts as settled, relative.
const SETTLED: f64 = 1e-10;

/// What a robust correction found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Robust<const M: usize> {
    /// The innovation against the sensor's own noise, for gates.
    pub innovation: Innovation<M>,
    /// What the measurement counted for: its noise was taken as `R / weight`. About one where it was expected, near zero for
    /// an outlier; never above `(ν + M) / ν`.
    pub weight: f64,
}

impl<const N: usize> Gaussian<N> {
    /// Corrects the belief by a `value` whose noise is multivariate Student's t of scale `R` and `degrees` `ν` of freedom: the
    /// farther off a measurement is, the less it is believed.
    ///
    /// The variational filter of Piché, Särkkä, Hartikainen (IEEE MLSP 2012) for one step: the noise is `R / λ` with `λ`
    /// gamma distributed, and state and `λ` are found in turns, `λ = (ν + M) / (ν + tr(R⁻¹ E[(z − H x)(z − H x)ᵀ]))`.
    /// With `ν` → ∞ it is [`update`](Self::update); 3 to 5 is usual where detectors jump.
    ///
    /// # Errors
    /// Where `degrees` is not positive, `R` is singular, or as [`update`](Self::update); the belief is then as it was.
    pub fn update_robust<const M: usize>(
        &mut self,
        measurement: &LinearMeasurement<M, N>,
        value: &SVector<f64, M>,
        degrees: f64,
    ) -> Result<Robust<M>> {
        require("degrees", degrees, degrees > 0.0, "positive")?;
        require_finite("the measurement", value)?;
        let root = cholesky(measurement.noise()).map_err(|(row, pivot)| EstimationError::NotPositive {
            what: "the measurement noise",
            requirement: "positive definite",
            row,
            pivot,
        })?;
        let residual = value - times_vector(measurement.matrix(), self.mean());
        let innovation = corrected(self, measurement, &residual)?.innovation;
        let (mut weight, mut after) = (1.0, *self);
        for _ in 0..ROUNDS {
            after = corrected(self, &measurement.with_noise(measurement.noise() / weight)?, &residual)?.belief;
            let left = value - times_vector(measurement.matrix(), after.mean());
            let doubt = divide_by_factored(&sandwich(measurement.matrix(), after.covariance()), &root).trace();
            let next = (degrees + M as f64) / (degrees + mahalanobis_squared(&root, &left) + doubt);
            // Zero where the distance squared overflows.
            if next <= f64::MIN_POSITIVE {
                return Err(EstimationError::Overflow { what: "the distance of the measurement" });
            }
            let settled = (next - weight).abs() <= SETTLED * next;
            weight = next;
            if settled {
                break;
            }
        }
        *self = after;
        Ok(Robust { innovation, weight })
    }
}
