//! What is known of a point when it is first seen.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use crate::error::require;
use crate::{Gaussian, Result};

/// Standard deviations of what a first position does not tell. The mean of all of it is zero.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PointStart {
    /// Of the velocity on each axis, px/s. > 0; about the fastest that targets move.
    pub speed_px_per_s: f64,
    /// Of every further component (the acceleration on each axis, px/s²; a turn rate, rad/s). > 0.
    pub further: f64,
}

impl PointStart {
    /// The belief at a measured `position` of this `noise`: `N` components of which the first two are the position, the next
    /// two the velocity.
    ///
    /// # Errors
    /// Where a number is out of range or not finite, or `noise` is not positive definite.
    pub fn at<const N: usize>(&self, position: &SVector<f64, 2>, noise: &SMatrix<f64, 2, 2>) -> Result<Gaussian<N>> {
        require("speed_px_per_s", self.speed_px_per_s, self.speed_px_per_s > 0.0, "positive")?;
        require("further", self.further, self.further > 0.0, "positive")?;
        let mean = SVector::from_fn(|r, _| if r < 2 { position[r] } else { 0.0 });
        let deviation = |r: usize| if r < 4 { self.speed_px_per_s } else { self.further };
        let covariance = SMatrix::from_fn(|r, c| match (r < 2, c < 2, r == c) {
            (true, true, _) => noise[(r, c)],
            (false, false, true) => deviation(r) * deviation(r),
            _ => 0.0,
        });
        Gaussian::new(mean, covariance)
    }
}
