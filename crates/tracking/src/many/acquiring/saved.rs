//! What is written down of one target that a detector finds.

use super::super::hypothesis::Evidence;
use super::super::{AcquisitionParams, LastFrame, TargetId};
use crate::Result;
use crate::class::Classes;
use pursuit_geometry::BBox;
use serde::{Deserialize, Serialize};

/// The state written down: each hypothesis with its tracker's own bytes.
#[derive(Serialize, Deserialize)]
pub(super) struct Raw {
    pub params: AcquisitionParams,
    /// Name and parameters (TOML).
    pub recipe: (String, String),
    /// The set's own bytes.
    pub targets: Vec<u8>,
    pub sought: Option<TargetId>,
    pub hypotheses: Vec<(Evidence, Classes, BBox, Vec<u8>)>,
    pub classes: Classes,
    pub lost_s: f64,
    pub apart_s: f64,
    pub last: Option<LastFrame>,
}

/// A [`Raw`] that has been checked.
#[derive(Deserialize)]
#[serde(try_from = "Raw")]
pub(super) struct Saved {
    pub params: AcquisitionParams,
    pub recipe: (String, String),
    pub targets: Vec<u8>,
    pub sought: Option<TargetId>,
    pub hypotheses: Vec<(Evidence, Classes, BBox, Vec<u8>)>,
    pub classes: Classes,
    pub lost_s: f64,
    pub apart_s: f64,
    pub last: Option<LastFrame>,
}

impl TryFrom<Raw> for Saved {
    type Error = &'static str;

    fn try_from(raw: Raw) -> Result<Self, Self::Error> {
        let Raw { params, recipe, targets, sought, hypotheses, classes, lost_s, apart_s, last } = raw;
        let sound = |e: &Evidence| e.nats.is_finite() && e.start.is_finite() && e.age_s.is_finite();
        let finite = lost_s.is_finite() && apart_s.is_finite() && classes.is_sound();
        if !hypotheses.iter().all(|(e, c, b, _)| sound(e) && c.is_sound() && b.is_finite())
            || !finite
            || last.is_some_and(|l| !l.time_s.is_finite())
        {
            return Err("a time, a box or evidence is not a finite number");
        }
        Ok(Self { params, recipe, targets, sought, hypotheses, classes, lost_s, apart_s, last })
    }
}
