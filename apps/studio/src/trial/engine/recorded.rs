//! A trajectory that was recorded elsewhere: it is looked at as one that was followed here, and gone on with where it ends.

use super::super::phase::Phase;
use super::Engine;
use crate::error::Refusal;
use crate::recording::Known;
use pursuit::revise::{Edit, EditKind, Row};

/// What is to be known of it while the follower has not caught up.
pub(super) struct Recorded {
    /// Whether it went on to the end of its input.
    is_whole: bool,
    /// Why it cannot be gone on with, where it cannot.
    fixed: Option<String>,
}

impl Engine {
    /// Puts a recorded trajectory in the place of the first frame, which was all that is known yet.
    pub(super) fn take_over(&mut self, known: Known) -> Result<(), Refusal> {
        let Known { rows, boxes, is_whole, fixed } = known;
        let Some(first) = rows.first().map(|row| row.frame) else { return Ok(()) };
        let numbered = (1..).zip(boxes);
        let edits =
            numbered.map(|(target, bbox)| Edit { frame: first, kind: EditKind::Add { target, bbox } }).collect();
        let recipe = self.follower.base().boxed_clone();
        // What cannot be followed again is not begun: its boxes may be in other pixels.
        self.follower.restart(recipe, if fixed.is_some() { Vec::new() } else { edits })?;
        while self.follower.step()?.is_some_and(|(_, row)| row.frame < first) {}
        let targets = |row: &Row| row.records.iter().map(|r| r.target.0).max().unwrap_or(0);
        self.last_target = rows.iter().map(targets).max().unwrap_or(0);
        self.trajectory.branch(0, "", self.tracker.name);
        rows.into_iter().for_each(|row| self.trajectory.push(row));
        self.recorded = Some(Recorded { is_whole, fixed });
        self.phase = Phase::Paused;
        let first = self.trajectory.first().map_or(first, |row| row.frame);
        let shown = self.pictures.get(first)?;
        self.shown = shown.ok_or_else(|| Refusal::unfit("its input has fewer frames than this run"))?;
        Ok(())
    }

    /// Whether what can be followed has been.
    ///
    /// # Errors
    /// As [`may_follow`](Self::may_follow).
    pub(super) fn is_recorded_whole(&self) -> Result<bool, Refusal> {
        match &self.recorded {
            Some(recorded) if recorded.is_whole => Ok(true),
            _ => self.may_follow().map(|()| false),
        }
    }

    /// # Errors
    /// Why a recorded trajectory cannot be gone on with or followed again.
    pub(super) fn may_follow(&self) -> Result<(), Refusal> {
        match self.recorded.as_ref().and_then(|recorded| recorded.fixed.clone()) {
            Some(why) => Err(Refusal::conflict(why)),
            None => Ok(()),
        }
    }
}
