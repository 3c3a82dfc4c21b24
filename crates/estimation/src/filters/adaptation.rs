//! Noise learnt from what the filter did not expect.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use crate::error::require;
use crate::matrix::{require_semi_definite, sandwich, symmetrise, times_vector};
use crate::{Gaussian, Innovation, LinearMeasurement, Result, Transition};

/// Measurement noise learnt from post-fit residuals `ε = z − H x⁺`: `R̂ = E[ε εᵀ] + H P⁺ Hᵀ` (Wang 2000; Mohamed and
/// Schwarz 1999), averaged exponentially. A sum of positive terms, so `R̂` never turns indefinite.
///
/// Learn this **or** [`ProcessNoiseScaling`] from one innovation sequence, not both fast: each explains the other's surprise.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(remote = "MeasurementNoiseAdaptation")]
pub struct MeasurementNoiseAdaptation<const M: usize> {
    weight: f64,
    noise: SMatrix<f64, M, M>,
}

crate::checked!([const M: usize] MeasurementNoiseAdaptation<M>);

impl<const M: usize> MeasurementNoiseAdaptation<M> {
    fn restored(self) -> Result<Self> {
        Self::new(self.noise, self.weight)
    }
}

impl<const M: usize> MeasurementNoiseAdaptation<M> {
    /// Learning from the first guess `noise`, each step with `weight` in (0, 1]; .02 averages about 50 steps.
    ///
    /// # Errors
    /// Where `weight` is outside (0, 1] or `noise` is not positive semi-definite.
    pub fn new(noise: SMatrix<f64, M, M>, weight: f64) -> Result<Self> {
        require("weight", weight, weight > 0.0 && weight <= 1.0, "in (0, 1]")?;
        Ok(Self { weight, noise: require_semi_definite("the measurement noise", &noise)? })
    }

    /// `R̂`.
    pub const fn noise(&self) -> &SMatrix<f64, M, M> {
        &self.noise
    }

    /// Learns from an update by `value` that led to the belief `after`, and returns the sensor with the noise as now known.
    ///
    /// # Errors
    /// Where the result is not finite; nothing is learnt then.
    pub fn learn<const N: usize>(
        &mut self,
        after: &Gaussian<N>,
        measurement: &LinearMeasurement<M, N>,
        value: &SVector<f64, M>,
    ) -> Result<LinearMeasurement<M, N>> {
        let residual = value - times_vector(measurement.matrix(), after.mean());
        let seen = residual * residual.transpose() + sandwich(measurement.matrix(), after.covariance());
        let mut noise = self.noise * (1.0 - self.weight) + seen * self.weight;
        symmetrise(&mut noise);
        let sensor = measurement.with_noise(noise)?;
        self.noise = noise;
        Ok(sensor)
    }
}

/// Process noise scaled so that innovations are as large as predicted (Ding et al. 2007): with `C` the averaged `ν νᵀ`,
/// `Q` is multiplied by `tr(C − R) / tr(H P⁻ Hᵀ)`, damped by a square root and clamped. The shape of `Q` stays.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(remote = "ProcessNoiseScaling")]
pub struct ProcessNoiseScaling {
    weight: f64,
    limits: (f64, f64),
    scale: f64,
    measured: f64,
    predicted: f64,
}

crate::checked!(ProcessNoiseScaling);

impl ProcessNoiseScaling {
    fn restored(self) -> Result<Self> {
        Self::new(self.weight, self.limits)?;
        // A scale starts at one and is clamped from the first innovation on.
        let (low, high) = (self.limits.0.min(1.0), self.limits.1.max(1.0));
        require("the scale", self.scale, (low..=high).contains(&self.scale), "within its limits")?;
        require("the average innovation", self.measured, true, "finite")?;
        require("the average foreseen", self.predicted, true, "finite")?;
        Ok(self)
    }
}

impl ProcessNoiseScaling {
    /// Scaling from 1, averaging innovations with `weight` in (0, 1] and keeping the factor within `limits`.
    ///
    /// # Errors
    /// Where `weight` is outside (0, 1], or the limits are not positive and in order.
    pub fn new(weight: f64, limits: (f64, f64)) -> Result<Self> {
        require("weight", weight, weight > 0.0 && weight <= 1.0, "in (0, 1]")?;
        require("the lower limit", limits.0, limits.0 > 0.0, "positive")?;
        require("the upper limit", limits.1, limits.1 >= limits.0, "no less than the lower limit")?;
        Ok(Self { weight, limits, scale: 1.0, measured: 0.0, predicted: 0.0 })
    }

    /// The factor on `Q`.
    pub const fn scale(&self) -> f64 {
        self.scale
    }

    /// `transition` with its noise scaled.
    ///
    /// # Errors
    /// Where the result overflows.
    pub fn scaled<const N: usize>(&self, transition: &Transition<N>) -> Result<Transition<N>> {
        transition.with_noise(transition.noise() * self.scale)
    }

    /// Learns from one innovation of a sensor with the given `noise` `R`.
    pub fn learn<const M: usize>(&mut self, innovation: &Innovation<M>, noise: &SMatrix<f64, M, M>) {
        let excess = innovation.residual().norm_squared() - noise.trace();
        let foreseen = (innovation.covariance() - noise).trace();
        self.measured += self.weight * (excess - self.measured);
        self.predicted += self.weight * (foreseen - self.predicted);
        if self.predicted > 0.0 {
            // What is averaged lags the factor it leads to, so the factor moves slowly too.
            let ratio = (self.measured / self.predicted).clamp(0.01, 100.0);
            self.scale = (self.scale * ratio.powf(0.5 * self.weight)).clamp(self.limits.0, self.limits.1);
        }
    }
}
