//! What is expected of a target in a frame: compared with any number of boxes.

use super::AssociationParams;
use crate::motion::MotionParams;
use crate::{BoxCovariance, Prior};
use nalgebra::Vector4;
use pursuit_estimation::EstimationError;
use pursuit_geometry::BBox;

/// The box that a target should have, and what a detector should measure of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::many) struct Expectation {
    bbox: BBox,
    root: Root,
}

/// The innovation covariance of centre and size taken apart: `S = L Lᵀ`.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Root {
    /// The diagonal of `L`.
    diagonal: [f64; 4],
    /// What is below it, column by column; `None` where that is nothing, as of axes that are not correlated.
    below: Option<[f64; 6]>,
}

impl Expectation {
    /// From the motion model's prior.
    ///
    /// # Errors
    /// Where the prior is no finite box.
    #[inline]
    pub fn new(prior: &Prior, motion: &MotionParams) -> Result<Self, EstimationError> {
        if !prior.bbox.is_finite() {
            return Err(EstimationError::NotFinite { what: "the box that is expected of a target" });
        }
        let modelled = prior.innovation_covariance.as_ref().and_then(Root::of);
        let root = modelled.or_else(|| Root::of(&unmodelled(prior, motion)));
        let what = "the covariance of what is expected of a target";
        Ok(Self { bbox: prior.bbox, root: root.ok_or(EstimationError::NotInvertible { what })? })
    }

    /// The predicted box.
    pub const fn bbox(&self) -> &BBox {
        &self.bbox
    }

    /// Squared Mahalanobis distance νᵀ S⁻¹ ν of a box's centre and size; infinite where it cannot be computed.
    #[inline]
    pub fn distance2(&self, bbox: &BBox) -> f64 {
        let (seen, mean) = (measured(bbox), measured(&self.bbox));
        let [x, y, w, h] = self.root.whitened(std::array::from_fn(|i| seen[i] - mean[i]));
        (x * x + w * w) + (y * y + h * h)
    }

    /// `ln det S` with lengths in sizes of the box.
    pub fn log_determinant(&self) -> f64 {
        let determinant: f64 = self.root.diagonal.iter().product();
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

impl Root {
    /// That of a covariance; `None` where it is none.
    #[inline]
    fn of(covariance: &BoxCovariance) -> Option<Self> {
        let apart = (0..4).all(|r| (0..r).all(|c| covariance[(r, c)] == 0.0));
        if apart {
            let variances: [f64; 4] = std::array::from_fn(|i| covariance[(i, i)]);
            let sound = variances.iter().fold(true, |sound, v| sound & (*v > 0.0) & (*v < f64::INFINITY));
            return sound.then(|| Self { diagonal: variances.map(f64::sqrt), below: None });
        }
        let finite = covariance.iter().all(|v| v.is_finite());
        let lower = covariance.cholesky().filter(|_| finite)?.unpack();
        Some(Self {
            diagonal: std::array::from_fn(|i| lower[(i, i)]),
            below: Some([(1, 0), (2, 0), (3, 0), (2, 1), (3, 1), (3, 2)].map(|at| lower[at])),
        })
    }

    /// `L⁻¹ ν`.
    #[inline]
    fn whitened(&self, mut off: [f64; 4]) -> [f64; 4] {
        let Some(below) = &self.below else { return std::array::from_fn(|i| off[i] / self.diagonal[i]) };
        let mut entries = below.iter();
        for c in 0..4 {
            off[c] /= self.diagonal[c];
            for (r, entry) in (c + 1..4).zip(entries.by_ref()) {
                off[r] -= off[c] * entry;
            }
        }
        off
    }
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
