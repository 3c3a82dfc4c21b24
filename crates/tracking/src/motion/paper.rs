//! Filters of a point that come from papers, as beliefs about a centre.

use super::center::{CenterBelief, Start, parts};
use crate::Velocity;
use nalgebra::{Matrix2, SMatrix, SVector};
use pursuit_estimation::Result;
use pursuit_estimation::point::{PointFilter, PointStart};
use pursuit_geometry::Point;
use serde::{Deserialize, Serialize};

/// A paper's filter in a unit of length of its own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Scaled<F> {
    /// Pixels in that unit.
    unit_px: f64,
    pub(super) filter: F,
}

/// Where a paper's filter begins, in its unit of length.
pub(super) struct ScaledStart {
    pub point: PointStart,
    pub at: SVector<f64, 2>,
    pub variance: f64,
    pub noise: SMatrix<f64, 2, 2>,
}

impl<F: PointFilter> Scaled<F> {
    /// The filter that `make` starts, with `unit_px` pixels in its unit of length.
    pub(super) fn new(start: &Start, unit_px: f64, make: impl FnOnce(ScaledStart) -> Result<F>) -> Result<Self> {
        let variance = start.position_variance / (unit_px * unit_px);
        let filter = make(ScaledStart {
            // None of the filters has a further component.
            point: PointStart { speed_px_per_s: start.noise.start_speed * start.extent_px / unit_px, further: 1.0 },
            at: SVector::from([start.at.x / unit_px, start.at.y / unit_px]),
            variance,
            noise: SMatrix::identity() * variance,
        })?;
        Ok(Self { unit_px, filter })
    }
}

impl<F: PointFilter> CenterBelief for Scaled<F> {
    fn correct(&mut self, at: Point, variance: f64) -> Result<()> {
        let unit_px = self.unit_px;
        let noise = SMatrix::<f64, 2, 2>::identity() * (variance / (unit_px * unit_px));
        self.filter.update(&SVector::from([at.x / unit_px, at.y / unit_px]), &noise).map(drop)
    }

    fn state(&self) -> (Point, Matrix2<f64>, Velocity) {
        let unit_px = self.unit_px;
        let (at, covariance, velocity) = parts(&self.filter.belief());
        let velocity = Velocity { x: velocity.x * unit_px, y: velocity.y * unit_px };
        (Point::new(at.x * unit_px, at.y * unit_px), covariance * (unit_px * unit_px), velocity)
    }
}
