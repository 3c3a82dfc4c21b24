//! The way back from a corrected frame, a frame at a time, so that it can be watched and broken off.

use super::super::phase::Phase;
use super::Engine;
use crate::error::Refusal;
use pursuit::BBox;
use pursuit::revise::{Backward, Edit, End};
use serde_json::{Value, json};
use std::ops::ControlFlow;
use std::time::Instant;

/// A way back that has not come to its end.
pub(super) struct Return {
    way: Backward,
    /// What the trial does afterwards.
    then: Phase,
}

impl Engine {
    /// Follows the target backward from the frame shown, in which it was put onto this box.
    pub(super) fn begin_return(&mut self, target: u64, bbox: BBox) -> Result<(), Refusal> {
        let way = Backward::new(self.follower.recipe(), target, &self.shown, bbox)?;
        self.returned = None;
        self.returning = Some(Return { way, then: self.phase });
        (self.phase, self.due) = (Phase::Running, Instant::now());
        Ok(())
    }

    /// What was asked for in the frame that was followed again just now.
    pub(super) fn return_if_asked(&mut self) -> Result<(), Refusal> {
        let frame = self.shown.index();
        let asked = self.follower.edits().iter().filter(|e| e.frame == frame).find_map(Edit::backward);
        asked.map_or(Ok(()), |(target, bbox)| self.begin_return(target, bbox))
    }

    /// One frame further back; whether there is a way back to go.
    pub(super) fn go_back(&mut self) -> bool {
        let Some(Return { mut way, then }) = self.returning.take() else { return false };
        match self.look_back(&mut way) {
            Ok(None) => self.returning = Some(Return { way, then }),
            Ok(Some(end)) => self.arrive(Return { way, then }, end),
            Err(refusal) => {
                self.arrive(Return { way, then }, End::Gone);
                self.message = Some(format!("following backward broke off: {}", refusal.message));
            }
        }
        true
    }

    fn look_back(&mut self, way: &mut Backward) -> Result<Option<End>, Refusal> {
        match way.step(&mut self.pictures, &mut self.trajectory, self.follower.edits())? {
            ControlFlow::Continue(frame) => self.shown = frame,
            ControlFlow::Break(end) => return Ok(Some(end)),
        }
        Ok(None)
    }

    /// Stays with what was found on the way back so far.
    pub(super) fn break_off_return(&mut self) {
        if let Some(there) = self.returning.take() {
            self.arrive(there, End::Stopped);
        }
    }

    /// Whether the trial goes on by itself once it is back; false without a way back.
    pub(super) fn start_after_return(&mut self) -> bool {
        let returning = self.returning.as_mut();
        returning.map(|there| there.then = Phase::Running).is_some()
    }

    /// Shows the corrected frame again.
    fn arrive(&mut self, Return { way, then }: Return, end: End) {
        let (target, from) = (way.target(), way.from());
        let to = way.finish(end, &mut self.trajectory);
        self.returned = Some(json!({ "target": target, "from": from, "to": to, "end": end }));
        (self.phase, self.due) = (then, Instant::now());
        if let Err(refusal) = self.look_at(from) {
            self.message = Some(refusal.message);
        }
    }

    /// The way back that is gone, or else the last one.
    pub(super) fn way_back(&self) -> Value {
        let going = self.returning.as_ref().map(
            |Return { way, then }| json!({ "target": way.target(), "from": way.from(), "to": way.at(), "end": null, "goes_on": *then == Phase::Running }),
        );
        going.or_else(|| self.returned.clone()).unwrap_or_default()
    }
}
