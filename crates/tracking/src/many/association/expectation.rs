//! What is expected of a target in a frame: compared with any number of boxes.

use super::AssociationParams;
use crate::motion::MotionParams;
use crate::{BoxCovariance, Prior};
use nalgebra::{Matrix4, Vector4};
use pursuit_estimation::{EstimationError, Gaussian};
use pursuit_geometry::BBox;

/// The box that a target should have, and what a detector should measure of it.
#[derive(Debug, Clone, Copy)]
pub(in crate::many) struct Expectation {
    bbox: BBox,
    /// Centre and size.
    measurement: Gaussian<4>,
}

impl Expectation {
    /// From the motion model's prior.
    ///
    /// # Errors
    /// Where the prior is no finite box.
    pub fn new(prior: &Prior, motion: &MotionParams) -> Result<Self, EstimationError> {
        let mean = measured(&prior.bbox);
        let modelled = prior.innovation_covariance.and_then(|covariance| Gaussian::new(mean, covariance).ok());
        let measurement = match modelled {
            Some(measurement) => measurement,
            None => Gaussian::new(mean, unmodelled(prior, motion))?,
        };
        Ok(Self { bbox: prior.bbox, measurement })
    }

    /// The predicted box.
    pub const fn bbox(&self) -> &BBox {
        &self.bbox
    }

    /// What a detector should measure: centre and size.
    pub const fn measurement(&self) -> &Gaussian<4> {
        &self.measurement
    }

    /// Squared Mahalanobis distance νᵀ S⁻¹ ν of a box's centre and size; infinite where it cannot be computed.
    pub fn distance2(&self, bbox: &BBox) -> f64 {
        self.measurement.nees(&measured(bbox)).unwrap_or(f64::INFINITY)
    }

    /// What distances are measured by.
    ///
    /// # Errors
    /// Where the covariance is singular.
    pub(super) fn spread(&self) -> Result<Spread, EstimationError> {
        let lower = self
            .measurement
            .covariance()
            .cholesky()
            .ok_or(EstimationError::NotInvertible { what: "the covariance of what is expected of a target" })?
            .unpack();
        let determinant = (0..4).map(|i| lower[(i, i)]).product::<f64>();
        let log_determinant = 2.0 * determinant.ln() - 4.0 * self.bbox.area().ln();
        Ok(Spread { lower, log_determinant })
    }

    /// Whether a box is near enough to be the target's, however little is known of where that is; `reach` is in sizes.
    pub fn reaches(&self, bbox: &BBox, reach: f64) -> bool {
        self.bbox.center().distance(bbox.center()) <= reach * extent_px(&self.bbox)
    }

    /// Whether a box may be the target's.
    pub fn admits(&self, bbox: &BBox, params: &AssociationParams) -> bool {
        self.reaches(bbox, params.reach) && self.distance2(bbox) <= params.gate
    }
}

/// The innovation covariance, taken apart.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spread {
    lower: Matrix4<f64>,
    /// `ln det S` with lengths in sizes of the box.
    pub log_determinant: f64,
}

impl Spread {
    /// `νᵀ S⁻¹ ν`; infinite where it cannot be computed.
    pub fn squared(&self, innovation: &Vector4<f64>) -> f64 {
        self.lower.solve_lower_triangular(innovation).map_or(f64::INFINITY, |white| white.norm_squared())
    }
}

/// Centre and size of a box.
pub(super) fn measured(bbox: &BBox) -> Vector4<f64> {
    let center = bbox.center();
    Vector4::new(center.x, center.y, bbox.width(), bbox.height())
}

/// The innovation covariance of a target whose motion is not modelled: anything the speed at the start allows.
fn unmodelled(prior: &Prior, motion: &MotionParams) -> BoxCovariance {
    let extent = extent_px(&prior.bbox);
    let square = |parts: [f64; 3]| parts.iter().map(|p| p * p).sum::<f64>();
    let floor = motion.noise_floor_px;
    let center = square([motion.position_noise * extent, motion.start_speed * extent * prior.dt_s, floor]);
    let size = square([motion.size_noise * extent, motion.size_change * extent * prior.dt_s.sqrt(), floor]);
    BoxCovariance::from_diagonal(&Vector4::new(center, center, size, size))
}

fn extent_px(bbox: &BBox) -> f64 {
    bbox.area().sqrt()
}
