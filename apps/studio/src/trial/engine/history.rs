//! Undo and redo: what a trial was before each change, and after it.

use super::super::phase::Phase;
use super::Engine;
use super::recorded::Recorded;
use crate::error::Refusal;
use pursuit::Recipe;
use pursuit::revise::{ChosenDetector, Edit, Label, Trajectory};
use pursuit::tracking::TrackerEntry;
use std::collections::{BTreeMap, VecDeque};

/// Changes that can be undone at most.
const MOST: usize = 100;
/// Rows that all of them together may hold on to; of long clips fewer changes can be undone.
const MOST_ROWS: usize = 1_000_000;

/// All that a trial is made of, at one moment. Rows are shared with the trajectory and not copied.
pub(super) struct Moment {
    /// What was done then.
    what: String,
    tracker: &'static TrackerEntry,
    base: Box<dyn Recipe>,
    seeking: Option<ChosenDetector>,
    edits: Vec<Edit>,
    trajectory: Trajectory,
    labels: BTreeMap<u64, Label>,
    last_target: u64,
    shown: u64,
    /// Whether the end of the input had been reached.
    ended: bool,
    /// Why it could not be followed on, where it could not.
    fixed: Option<String>,
    from_folder: bool,
}

impl Moment {
    /// Whether the trial has become another since.
    pub fn differs(&self, now: &Engine) -> bool {
        let recipes = [self.base.parameters().ok(), now.follower.base().parameters().ok()];
        self.tracker.name != now.tracker.name
            || self.edits != now.follower.edits()
            || self.labels != now.labels
            || self.trajectory.revision() != now.trajectory.revision()
            || self.seeking.is_some() != now.follower.seeking().is_some()
            || recipes[0] != recipes[1]
    }
}

#[derive(Default)]
pub(super) struct History {
    past: VecDeque<Moment>,
    future: Vec<Moment>,
}

impl History {
    /// What would be undone, and what done again.
    pub fn names(&self) -> [Option<&str>; 2] {
        [self.past.back(), self.future.last()].map(|moment| moment.map(|moment| &*moment.what))
    }

    /// Something was done; what this was before can be had again.
    pub fn push(&mut self, before: Moment) {
        self.future.clear();
        self.past.push_back(before);
        let rows = |past: &VecDeque<Moment>| past.iter().map(|m| m.trajectory.len()).sum::<usize>();
        while self.past.len() > MOST || (self.past.len() > 1 && rows(&self.past) > MOST_ROWS) {
            self.past.pop_front();
        }
    }
}

impl Engine {
    /// How it is now, before this is done.
    pub(super) fn moment(&self, what: &str) -> Moment {
        Moment {
            what: what.to_owned(),
            tracker: self.tracker,
            base: self.follower.base().boxed_clone(),
            seeking: self.follower.seeking().cloned(),
            edits: self.follower.edits().to_vec(),
            trajectory: self.trajectory.clone(),
            labels: self.labels.clone(),
            last_target: self.last_target,
            shown: self.shown.index(),
            ended: self.phase == Phase::Ended || self.recorded.as_ref().is_some_and(|recorded| recorded.is_whole),
            fixed: self.recorded.as_ref().and_then(|recorded| recorded.fixed.clone()),
            from_folder: self.recorded.as_ref().is_some_and(|recorded| recorded.from_folder),
        }
    }

    /// # Errors
    /// Where nothing can be undone.
    pub(super) fn undo(&mut self) -> Result<(), Refusal> {
        let before = self.history.past.pop_back().ok_or_else(|| Refusal::conflict("there is nothing to undo"))?;
        let now = self.moment(&before.what);
        match self.restore(before) {
            Ok(()) => self.history.future.push(now),
            Err((before, refusal)) => {
                self.history.past.push_back(*before);
                return Err(refusal);
            }
        }
        Ok(())
    }

    /// # Errors
    /// Where nothing was undone.
    pub(super) fn redo(&mut self) -> Result<(), Refusal> {
        let after = self.history.future.pop().ok_or_else(|| Refusal::conflict("there is nothing to do again"))?;
        let now = self.moment(&after.what);
        match self.restore(after) {
            Ok(()) => self.history.past.push_back(now),
            Err((after, refusal)) => {
                self.history.future.push(*after);
                return Err(refusal);
            }
        }
        Ok(())
    }

    /// Becomes what it was. What had been followed stands at once; the follower catches up with it when it is to go on.
    fn restore(&mut self, moment: Moment) -> Result<(), (Box<Moment>, Refusal)> {
        let revised = self.follower.revise(moment.base.boxed_clone(), moment.seeking.clone(), moment.edits.clone());
        if let Err(error) = revised {
            return Err((Box::new(moment), error.into()));
        }
        let Moment { tracker, trajectory, labels, last_target, shown, ended, fixed, from_folder, .. } = moment;
        self.trajectory.restore(trajectory);
        (self.tracker, self.labels, self.last_target) = (tracker, labels, last_target);
        (self.message, self.returned) = (None, None);
        let head = self.trajectory.last().map(|row| row.frame);
        let caught_up = self.follower.at() == head && !ended && fixed.is_none();
        self.recorded = (!caught_up).then_some(Recorded { is_whole: ended, fixed, from_folder });
        let begun = self.trajectory.len() > 1 || !self.follower.edits().is_empty();
        self.phase = match (ended, begun) {
            (true, _) => Phase::Ended,
            (false, true) => Phase::Paused,
            (false, false) => Phase::Ready,
        };
        // The place that one looks at stays, as far as it is there.
        let shown = if self.trajectory.at(self.shown.index()).is_some() { self.shown.index() } else { shown };
        let known = self.trajectory.at(shown).or_else(|| self.trajectory.last()).map(|row| row.frame);
        if let Some(Err(refusal)) = known.map(|frame| self.look_at(frame)) {
            self.message = Some(refusal.message);
        }
        Ok(())
    }
}
