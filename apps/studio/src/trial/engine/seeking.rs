//! What a detector does in a trial: it shows boxes to begin from, or finds the target itself. And what is shown of a frame
//! beside its picture.

use super::super::looks::Look;
use super::super::phase::Phase;
use super::Engine;
use crate::error::Refusal;
use pursuit::revise::ChosenDetector;
use pursuit::tracking::Followed;
use pursuit::{BBox, Frame, TrackState};
use serde_json::{Value, json};
use std::sync::Arc;

/// Boxes that are shown, the best.
const MOST_PROPOSALS: usize = 100;

impl Engine {
    /// From the first frame on, this finds the target; what was looked at without a target is forgotten.
    pub(super) fn seek_target(&mut self, seeking: ChosenDetector) -> Result<(), Refusal> {
        if self.follower.info().live {
            return Err(Refusal::conflict(
                "a live source is searched from its first frame on; open it once more, with the detector chosen before",
            ));
        }
        self.may_follow()?;
        self.follower.seek(seeking)?;
        self.recorded = None;
        let first = self.follower.step()?;
        let (frame, row) = first.ok_or_else(|| Refusal::unfit("this source has no frames any more"))?;
        self.trajectory.branch(0, "found by a detector", self.tracker.name);
        self.trajectory.push(row);
        self.pictures.keep(&frame);
        (self.shown, self.last_target) = (frame, self.last_target.max(1));
        Ok(())
    }

    /// Asks the detector about the frame shown, where it stands still.
    pub(super) fn propose(&mut self) {
        let Some(proposer) = self.proposer.as_mut().filter(|_| self.phase != Phase::Running) else { return };
        let row = self.trajectory.at(self.shown.index());
        let estimates = row.iter().flat_map(|row| &row.records).filter_map(|r| r.estimate.as_ref());
        let followed: Vec<Followed> = estimates
            .filter(|e| e.state != TrackState::Lost)
            .map(|e| Followed { bbox: e.bbox, measured: e.state == TrackState::Tracking })
            .collect();
        if let Err(error) = proposer.look(&self.shown, &followed, &mut self.pictures) {
            self.proposer = None;
            self.message = Some(format!("the detector sees nothing here: {error}"));
        }
    }

    /// Looks at frames in this way from now on.
    pub(super) fn look(&mut self, look: Look) -> Result<(), Refusal> {
        if !Look::of(&self.shown).contains(&look) {
            return Err(Refusal::conflict("the frames of this source have no depth"));
        }
        self.looks.look = look;
        Ok(())
    }

    /// The frame shown, as it is looked at.
    pub(super) fn seen(&mut self) -> Arc<Frame> {
        match self.looks.at(&self.shown, &mut self.pictures) {
            Ok(frame) => frame,
            Err(refusal) => {
                (self.looks.look, self.message) = (Look::Picture, Some(refusal.message));
                self.shown.clone()
            }
        }
    }

    /// The detector with its parameters, and what it sees in the frame shown: left, top, width, height, confidence.
    pub(super) fn proposals(&self) -> (Value, Value) {
        let Some(proposer) = &self.proposer else { return (Value::Null, json!([])) };
        let five = |(b, confidence): (BBox, f64)| [b.left(), b.top(), b.width(), b.height(), confidence];
        let boxes: Vec<[f64; 5]> = proposer.boxes(self.shown.index()).take(MOST_PROPOSALS).map(five).collect();
        (json!({ "name": proposer.seeking.name(), "parameters": proposer.seeking.values() }), json!(boxes))
    }
}
