//! A trajectory that was recorded elsewhere: it is looked at as one that was followed here, and gone on with where it ends.

use super::super::MOST_TARGETS;
use super::super::phase::Phase;
use super::Engine;
use crate::error::Refusal;
use crate::recording::Known;
use pursuit::revise::{Edit, Identity, Imported, Row};
use std::collections::BTreeSet;

/// What is to be known of it while the follower has not caught up.
pub(super) struct Recorded {
    /// Whether it went on to the end of its input.
    pub is_whole: bool,
    /// Why it cannot be gone on with, where it cannot.
    pub fixed: Option<String>,
    /// Whether it comes from a folder, and was not changed since.
    pub from_folder: bool,
}

impl Engine {
    /// Puts a recorded trajectory in the place of the first frame, which was all that is known yet.
    pub(super) fn take_over(&mut self, known: Known) -> Result<(), Refusal> {
        let Known { rows, revised, is_whole, fixed } = known;
        let Some(first) = rows.first().map(|row| row.frame) else { return Ok(()) };
        let recipe = self.follower.base().boxed_clone();
        // What cannot be followed again is not begun: its boxes may be in other pixels.
        self.follower.restart(recipe, if fixed.is_some() { Vec::new() } else { revised.edits })?;
        while self.follower.step()?.is_some_and(|(_, row)| row.frame < first) {}
        let targets = |row: &Row| row.records.iter().map(|r| r.target.0).max().unwrap_or(0);
        self.last_target = rows.iter().map(targets).max().unwrap_or(0).max(revised.last_target);
        self.labels = revised.labels;
        self.trajectory.branch(0, "", self.tracker.name);
        rows.into_iter().for_each(|row| self.trajectory.push(row));
        self.recorded = Some(Recorded { is_whole, fixed, from_folder: true });
        self.phase = Phase::Paused;
        let first = self.trajectory.first().map_or(first, |row| row.frame);
        let shown = self.pictures.get(first)?;
        self.shown = shown.ok_or_else(|| Refusal::unfit("its input has fewer frames than this run"))?;
        Ok(())
    }

    /// Calls targets otherwise. What was followed stands; it is caught up with when it is to go on.
    ///
    /// # Errors
    /// Targets that there are not, or not there; a live source, which cannot be followed again.
    pub(super) fn identify(&mut self, identity: &Identity) -> Result<(), Refusal> {
        if self.follower.info().live {
            return Err(Refusal::conflict("targets of a live source keep their numbers: it cannot be followed again"));
        }
        let rows: Vec<Row> = self.trajectory.rows().map(|row| (**row).clone()).collect();
        let (rows, edits) = identity.apply(&rows, self.follower.edits())?;
        let (base, seeking) = (self.follower.base().boxed_clone(), self.follower.seeking().cloned());
        let recorded = self.recorded.take();
        let is_whole = self.phase == Phase::Ended || recorded.as_ref().is_some_and(|recorded| recorded.is_whole);
        let fixed = recorded.and_then(|recorded| recorded.fixed);
        self.follower.revise(base, seeking, if fixed.is_some() { Vec::new() } else { edits })?;
        let why = match identity {
            Identity::Merge { .. } => "two targets merged",
            Identity::Split { .. } => "a target split",
            Identity::Swap { .. } => "two targets swapped",
        };
        self.trajectory.branch(0, why, self.tracker.name);
        rows.into_iter().for_each(|row| self.trajectory.push(row));
        match identity {
            Identity::Merge { target, into } => {
                if let Some(label) = self.labels.remove(target) {
                    self.labels.entry(*into).or_insert(label);
                }
            }
            Identity::Split { new, .. } => self.last_target = self.last_target.max(*new),
            Identity::Swap { .. } => {}
        }
        self.recorded = Some(Recorded { is_whole, fixed, from_folder: false });
        self.pause();
        Ok(())
    }

    /// Takes a trajectory that was made elsewhere in the place of what there is.
    ///
    /// # Errors
    /// A file of none of the forms that are known, or of another input.
    pub(super) fn import(&mut self, text: &[u8]) -> Result<(), Refusal> {
        let Imported { rows, edits, labels } = Imported::read(text, self.follower.info())?;
        if self.follower.info().live {
            return Err(Refusal::conflict("a trajectory is read back over a file, not over a live source"));
        }
        let targets: BTreeSet<u64> = edits.iter().filter_map(Edit::drawn).collect();
        let fixed = (targets.len() > MOST_TARGETS).then(|| {
            format!("these {} targets are looked at and not followed on: {MOST_TARGETS} is the most", targets.len())
        });
        let base = self.follower.base().boxed_clone();
        self.follower.revise(base, None, if fixed.is_some() { Vec::new() } else { edits })?;
        self.trajectory.branch(0, "a file was read", self.tracker.name);
        let is_whole = self.follower.info().frame_count.is_some_and(|n| rows.last().is_some_and(|r| r.frame + 1 == n));
        rows.into_iter().for_each(|row| self.trajectory.push(row));
        self.last_target = self.last_target.max(targets.last().copied().unwrap_or(0));
        self.labels.extend(labels);
        self.recorded = Some(Recorded { is_whole, fixed, from_folder: false });
        self.phase = Phase::Paused;
        let first = self.trajectory.at(self.shown.index()).or_else(|| self.trajectory.first()).map(|row| row.frame);
        first.map_or(Ok(()), |frame| self.look_at(frame))
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
