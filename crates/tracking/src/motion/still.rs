//! No motion: the target is expected where it was seen last.

use super::{MotionFilter, Sight};
use crate::roles::Prior;
use crate::{BoxCovariance, Velocity};
use pursuit_estimation::{EstimationError, Result};
use pursuit_geometry::BBox;
use serde::{Deserialize, Serialize};

/// The box measured last, expected to stay.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct StillBox(BBox);

impl StillBox {
    /// At rest at `bbox`.
    ///
    /// # Errors
    /// When the box is not finite.
    pub fn new(bbox: BBox) -> Result<Self> {
        if bbox.is_finite() { Ok(Self(bbox)) } else { Err(EstimationError::NotFinite { what: "the box" }) }
    }
}

impl MotionFilter for StillBox {
    fn predict(&mut self, dt_s: f64) -> Result<Prior> {
        Ok(Prior { bbox: self.0, innovation_covariance: None, dt_s })
    }

    fn correct(&mut self, sight: &Sight) -> Result<()> {
        if !sight.bbox.is_finite() {
            return Err(EstimationError::NotFinite { what: "the measured box" });
        }
        self.0 = sight.bbox;
        Ok(())
    }

    fn restart(&mut self, bbox: BBox) {
        if bbox.is_finite() {
            self.0 = bbox;
        }
    }

    fn bbox(&self) -> BBox {
        self.0
    }

    fn covariance(&self) -> Option<BoxCovariance> {
        None
    }

    fn velocity(&self) -> Option<Velocity> {
        None
    }
}
