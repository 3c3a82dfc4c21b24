//! What is expected of a target in a frame: compared with any number of boxes.

use super::AssociationParams;
use crate::motion::MotionParams;
use crate::{BoxCovariance, Prior};
use nalgebra::{Matrix4, Vector4};
use pursuit_estimation::EstimationError;
use pursuit_geometry::BBox;

/// The box that a target should have, and what a detector should measure of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::many) struct Expectation {
    bbox: BBox,
    /// Centre and size.
    mean: Vector4<f64>,
    /// Their innovation covariance taken apart: `S = L Lᵀ`.
    lower: Matrix4<f64>,
}

impl Expectation {
    /// From the motion model's prior.
    ///
    /// # Errors
    /// Where the prior is no finite box.
    pub fn new(prior: &Prior, motion: &MotionParams) -> Result<Self, EstimationError> {
        let mean = measured(&prior.bbox);
        if !mean.iter().all(|v| v.is_finite()) {
            return Err(EstimationError::NotFinite { what: "the box that is expected of a target" });
        }
        let modelled = prior.innovation_covariance.and_then(taken_apart);
        let lower = modelled.or_else(|| taken_apart(unmodelled(prior, motion)));
        let what = "the covariance of what is expected of a target";
        Ok(Self { bbox: prior.bbox, mean, lower: lower.ok_or(EstimationError::NotInvertible { what })? })
    }

    /// The predicted box.
    pub const fn bbox(&self) -> &BBox {
        &self.bbox
    }

    /// Squared Mahalanobis distance νᵀ S⁻¹ ν of a box's centre and size; infinite where it cannot be computed.
    pub fn distance2(&self, bbox: &BBox) -> f64 {
        let innovation = measured(bbox) - self.mean;
        self.lower.solve_lower_triangular(&innovation).map_or(f64::INFINITY, |white| white.norm_squared())
    }

    /// `ln det S` with lengths in sizes of the box.
    pub fn log_determinant(&self) -> f64 {
        let determinant = (0..4).map(|i| self.lower[(i, i)]).product::<f64>();
        2.0 * determinant.ln() - 4.0 * self.bbox.area().ln()
    }

    /// Whether a box is near enough to be the target's, however little is known of where that is; `reach` is in sizes.
    pub fn reaches(&self, bbox: &BBox, reach: f64) -> bool {
        let (from, to) = (self.bbox.center(), bbox.center());
        let (dx, dy) = (to.x - from.x, to.y - from.y);
        dx * dx + dy * dy <= reach * reach * self.bbox.area()
    }

    /// Whether a box may be the target's.
    pub fn admits(&self, bbox: &BBox, params: &AssociationParams) -> bool {
        self.reaches(bbox, params.reach) && self.distance2(bbox) <= params.gate
    }
}

/// The lower triangle `L` of a covariance `L Lᵀ`; `None` where it is none.
fn taken_apart(covariance: BoxCovariance) -> Option<Matrix4<f64>> {
    let finite = covariance.iter().all(|v| v.is_finite());
    covariance.cholesky().filter(|_| finite).map(|found| found.unpack())
}

/// Centre and size of a box.
fn measured(bbox: &BBox) -> Vector4<f64> {
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
