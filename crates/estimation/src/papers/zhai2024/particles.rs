//! The paper's particle filter: particles follow the estimated velocity, and spread by the maximum-likelihood variance.

use nalgebra::SVector;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use super::{VarianceEstimate, VarianceParams};
use crate::Result;
use crate::error::{require, require_time_step};
use crate::matrix::require_finite;
use crate::particle::{ParticleFilter, ParticleOptions};

/// Particles over a position `[x, y]`, equations (22) to (25): `x ← x + v dt + ε`, `ε ~ N(0, s_k)`, with `v` from the last
/// two estimates and `s_k` from the residuals between what was found and what was predicted.
///
/// One frame is [`predict`](Self::predict), then weighing through [`particles_mut`](Self::particles_mut), then
/// [`correct`](Self::correct) with the position found.
#[derive(Debug, Serialize, Deserialize)]
#[serde(remote = "LikelihoodNoiseFilter")]
pub struct LikelihoodNoiseFilter {
    particles: ParticleFilter<2>,
    variance: VarianceEstimate<2>,
    estimate_px: SVector<f64, 2>,
    velocity_px_per_s: SVector<f64, 2>,
    predicted_px: SVector<f64, 2>,
    since_s: f64,
}

crate::checked!(LikelihoodNoiseFilter);

impl LikelihoodNoiseFilter {
    fn restored(self) -> Result<Self> {
        require_finite("the estimate", &self.estimate_px)?;
        require_finite("the velocity", &self.velocity_px_per_s)?;
        require_finite("the prediction", &self.predicted_px)?;
        require("the time since the last frame", self.since_s, self.since_s >= 0.0, "zero or more")?;
        Ok(self)
    }
}

impl Clone for LikelihoodNoiseFilter {
    fn clone(&self) -> Self {
        Self { particles: self.particles.clone(), ..*self }
    }

    /// Allocates nothing where `self` has had as many particles.
    fn clone_from(&mut self, source: &Self) {
        self.particles.clone_from(&source.particles);
        self.variance = source.variance;
        (self.estimate_px, self.velocity_px_per_s) = (source.estimate_px, source.velocity_px_per_s);
        (self.predicted_px, self.since_s) = (source.predicted_px, source.since_s);
    }
}

impl LikelihoodNoiseFilter {
    /// A filter of `count` particles, all at `position_px`, at rest.
    ///
    /// # Errors
    /// Where `count` is zero, a number is not finite or a parameter is out of range.
    pub fn new(
        count: usize,
        position_px: SVector<f64, 2>,
        params: VarianceParams,
        options: ParticleOptions,
        seed: u64,
    ) -> Result<Self> {
        Ok(Self {
            particles: ParticleFilter::from_states(vec![position_px; count], options, seed)?,
            variance: VarianceEstimate::new(params)?,
            estimate_px: position_px,
            velocity_px_per_s: SVector::zeros(),
            predicted_px: position_px,
            since_s: 0.0,
        })
    }

    /// The particles, to look at.
    pub const fn particles(&self) -> &ParticleFilter<2> {
        &self.particles
    }

    /// The particles, to weigh.
    pub const fn particles_mut(&mut self) -> &mut ParticleFilter<2> {
        &mut self.particles
    }

    /// The variance of each axis that the next prediction spreads by, px².
    pub fn variance_px2(&self) -> SVector<f64, 2> {
        self.variance.variance()
    }

    /// The position predicted for this frame.
    pub const fn predicted_px(&self) -> &SVector<f64, 2> {
        &self.predicted_px
    }

    /// Moves the particles over `dt_s` seconds.
    ///
    /// # Errors
    /// Where `dt_s` is not positive and finite, or a particle overflows; the filter is then as it was.
    pub fn predict(&mut self, dt_s: f64) -> Result<()> {
        self.predict_by(&(self.velocity_px_per_s * dt_s), dt_s)
    }

    /// [`predict`](Self::predict) where the target is known to move by `shift_px` in those `dt_s` seconds, from better
    /// knowledge than its last two positions.
    ///
    /// # Errors
    /// Where `dt_s` is not positive and finite, or a particle overflows; the filter is then as it was.
    pub fn predict_by(&mut self, shift_px: &SVector<f64, 2>, dt_s: f64) -> Result<()> {
        require_time_step(dt_s)?;
        let shift = *shift_px;
        let deviation = self.variance.variance().map(f64::sqrt);
        self.particles.predict_with(|state, generator| {
            let normal = SVector::from_fn(|_, _| StandardNormal.sample(generator));
            state + shift + deviation.component_mul(&normal)
        })?;
        self.predicted_px += shift;
        self.since_s += dt_s;
        Ok(())
    }

    /// Moves all particles such that their weighted mean is `at_px`: what was found for certain tells where they belong.
    ///
    /// # Errors
    /// Where the position is not finite; the filter is then as it was.
    pub fn center_on(&mut self, at_px: &SVector<f64, 2>) -> Result<()> {
        require_finite("the position", at_px)?;
        let shift = at_px - self.particles.mean();
        self.particles.predict_with(|state, _| state + shift)
    }

    /// Ends the frame with the position `found_px` (a detector's, or the particles' weighted mean): learns variance and
    /// velocity, and resamples if needed. A frame in which nothing was found is no call.
    ///
    /// # Errors
    /// Where a number is not finite; the filter is then as it was.
    pub fn correct(&mut self, found_px: &SVector<f64, 2>) -> Result<()> {
        require_finite("the position found", found_px)?;
        self.particles.resample_if_needed()?;
        self.variance.observe(&(found_px - self.predicted_px))?;
        if self.since_s > 0.0 {
            self.velocity_px_per_s = (found_px - self.estimate_px) / self.since_s;
        }
        (self.estimate_px, self.predicted_px, self.since_s) = (*found_px, *found_px, 0.0);
        Ok(())
    }
}

/// The Bhattacharyya coefficient `Σ √(p q)` of two histograms that sum to one, equation (26): 1 for equal ones.
///
/// # Errors
/// Where the lengths differ.
pub fn bhattacharyya_coefficient(p: &[f64], q: &[f64]) -> Result<f64> {
    if p.len() != q.len() {
        return Err(crate::EstimationError::Length { what: "bins of a histogram", got: q.len(), expected: p.len() });
    }
    Ok(p.iter().zip(q).map(|(a, b)| (a * b).sqrt()).sum())
}

/// The logarithm of a particle's weight, equation (27), up to a constant: `−(1 − ρ) / (2 σ_w²)`. `sigma_w` is the
/// likelihood's width, about .1, and not the motion noise.
pub fn similarity_log_likelihood(coefficient: f64, sigma_w: f64) -> f64 {
    -(1.0 - coefficient) / (2.0 * sigma_w * sigma_w)
}
