//! What is written down of one target that a detector finds.

use super::super::hypothesis::Evidence;
use super::super::{AcquisitionParams, TargetId};
use crate::belief::LastFrame;
use crate::class::Classes;
use pursuit_geometry::BBox;
use serde::{Deserialize, Serialize};

/// The state written down: each hypothesis with its tracker's own bytes.
#[derive(Serialize, Deserialize)]
#[serde(remote = "Saved")]
pub(super) struct Saved {
    pub params: AcquisitionParams,
    /// Name and parameters (TOML).
    pub recipe: (String, String),
    /// The set's own bytes.
    pub targets: Vec<u8>,
    pub sought: Option<TargetId>,
    pub hypotheses: Vec<(Evidence, Classes, BBox, Vec<u8>)>,
    pub classes: Classes,
    pub lost_s: f64,
    pub last: Option<LastFrame>,
}

pursuit_estimation::checked!(Saved);

impl Saved {
    fn restored(self) -> Result<Self, &'static str> {
        let sound = |e: &Evidence| e.nats.0.is_finite() && e.start.is_finite() && e.age_s.is_finite();
        let finite = self.lost_s.is_finite() && self.classes.is_sound();
        if !self.hypotheses.iter().all(|(e, c, b, _)| sound(e) && c.is_sound() && b.is_finite())
            || !finite
            || self.last.is_some_and(|l| !l.time_s.is_finite())
        {
            return Err("a time, a box or evidence is not a finite number");
        }
        Ok(self)
    }
}
