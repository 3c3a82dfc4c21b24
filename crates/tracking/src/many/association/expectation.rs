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
    mean: [f64; 4],
    root: Root,
}

/// The innovation covariance of centre and size taken apart: `S = L Lᵀ`.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Root {
    /// The diagonal of `L`, where nothing else is in it: the usual case.
    Diagonal([f64; 4]),
    Lower(Matrix4<f64>),
}

impl Expectation {
    /// From the motion model's prior.
    ///
    /// # Errors
    /// Where the prior is no finite box.
    #[inline]
    pub fn new(prior: &Prior, motion: &MotionParams) -> Result<Self, EstimationError> {
        let mean = measured(&prior.bbox);
        if !mean.iter().all(|v| v.is_finite()) {
            return Err(EstimationError::NotFinite { what: "the box that is expected of a target" });
        }
        let modelled = prior.innovation_covariance.as_ref().and_then(taken_apart);
        let root = modelled.or_else(|| taken_apart(&unmodelled(prior, motion)));
        let what = "the covariance of what is expected of a target";
        Ok(Self { bbox: prior.bbox, mean, root: root.ok_or(EstimationError::NotInvertible { what })? })
    }

    /// The predicted box.
    pub const fn bbox(&self) -> &BBox {
        &self.bbox
    }

    /// Squared Mahalanobis distance νᵀ S⁻¹ ν of a box's centre and size; infinite where it cannot be computed.
    #[inline]
    pub fn distance2(&self, bbox: &BBox) -> f64 {
        let seen = measured(bbox);
        let innovation: [f64; 4] = std::array::from_fn(|i| seen[i] - self.mean[i]);
        match &self.root {
            Root::Diagonal(deviations) => {
                let [x, y, w, h] = std::array::from_fn(|i| innovation[i] / deviations[i]);
                (x * x + w * w) + (y * y + h * h)
            }
            Root::Lower(lower) => {
                let white = lower.solve_lower_triangular(&Vector4::from(innovation));
                white.map_or(f64::INFINITY, |white| white.norm_squared())
            }
        }
    }

    /// `ln det S` with lengths in sizes of the box.
    pub fn log_determinant(&self) -> f64 {
        let determinant: f64 = match &self.root {
            Root::Diagonal(deviations) => deviations.iter().product(),
            Root::Lower(lower) => (0..4).map(|i| lower[(i, i)]).product(),
        };
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

/// The root of a covariance; `None` where it is none.
#[inline]
fn taken_apart(covariance: &BoxCovariance) -> Option<Root> {
    let apart = (0..4).all(|r| (0..r).all(|c| covariance[(r, c)] == 0.0));
    if apart {
        let variances: [f64; 4] = std::array::from_fn(|i| covariance[(i, i)]);
        let sound = variances.iter().all(|v| *v > 0.0 && v.is_finite());
        return sound.then(|| Root::Diagonal(variances.map(f64::sqrt)));
    }
    let finite = covariance.iter().all(|v| v.is_finite());
    covariance.cholesky().filter(|_| finite).map(|found| Root::Lower(found.unpack()))
}

/// Centre and size of a box.
#[inline]
fn measured(bbox: &BBox) -> [f64; 4] {
    let center = bbox.center();
    [center.x, center.y, bbox.width(), bbox.height()]
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
