//! The half-interval filter of `zhu2014` in seconds.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use super::{PointFilter, PointStart};
use crate::error::require_time_step;
use crate::papers::zhu2014::{HalfIntervalFilter, Zhu2014Params};
use crate::{Gaussian, Innovation, Result};

/// [`HalfIntervalFilter`] with the patent's time unit, the frame, given in seconds: `Zhu2014Params` mean what they say
/// there (velocities in px a frame) whatever the frame rate. Steps longer than a frame are steps of several frames.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(remote = "HalfIntervalPoint")]
pub struct HalfIntervalPoint {
    params: Zhu2014Params,
    frame_s: f64,
    start: PointStart,
    /// In px and px a frame.
    filter: HalfIntervalFilter,
}

crate::checked!(HalfIntervalPoint);

impl HalfIntervalPoint {
    fn restored(self) -> Result<Self> {
        require_time_step(self.frame_s)?;
        Ok(self)
    }
}

impl HalfIntervalPoint {
    /// A filter first seen at `position` with noise covariance `noise`, of a source with a frame each `frame_s` seconds.
    ///
    /// # Errors
    /// Where a parameter is out of range or `noise` is not positive definite.
    pub fn new(
        params: Zhu2014Params,
        frame_s: f64,
        start: PointStart,
        position: &SVector<f64, 2>,
        noise: &SMatrix<f64, 2, 2>,
    ) -> Result<Self> {
        require_time_step(frame_s)?;
        let belief = scaled(&start.at(position, noise)?, frame_s);
        Ok(Self { params, frame_s, start, filter: HalfIntervalFilter::new(params, belief)? })
    }
}

/// The belief with its velocities multiplied by `factor`.
fn scaled(belief: &Gaussian<4>, factor: f64) -> Gaussian<4> {
    let scale = [1.0, 1.0, factor, factor];
    let covariance = SMatrix::from_fn(|r, c| belief.covariance()[(r, c)] * (scale[r] * scale[c]));
    Gaussian::trusted(belief.mean().component_mul(&SVector::from(scale)), covariance)
}

impl PointFilter for HalfIntervalPoint {
    fn predict(&mut self, dt_s: f64) -> Result<()> {
        require_time_step(dt_s)?;
        self.filter.predict(dt_s / self.frame_s)
    }

    /// Returns the innovation against the plain prediction: what a manoeuvre is judged by.
    fn update(&mut self, position: &SVector<f64, 2>, noise: &SMatrix<f64, 2, 2>) -> Result<Innovation<2>> {
        Ok(self.filter.update_with_noise(position, noise)?.innovation)
    }

    fn belief(&self) -> Gaussian<4> {
        scaled(self.filter.belief(), 1.0 / self.frame_s)
    }

    fn forecast(&self, dt_s: f64) -> Result<Gaussian<4>> {
        require_time_step(dt_s)?;
        Ok(scaled(&self.filter.forecast(dt_s / self.frame_s)?, 1.0 / self.frame_s))
    }

    fn restart(&mut self, position: &SVector<f64, 2>, noise: &SMatrix<f64, 2, 2>) -> Result<()> {
        *self = Self::new(self.params, self.frame_s, self.start, position, noise)?;
        Ok(())
    }
}
