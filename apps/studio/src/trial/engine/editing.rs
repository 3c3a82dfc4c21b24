//! What the user changes: targets, boxes, parameters, the method.

use super::super::phase::Phase;
use super::super::{MOST_EDITS, MOST_TARGETS};
use super::Engine;
use crate::error::Refusal;
use pursuit::parameters::nested;
use pursuit::revise::{Edit, EditKind, Label, Row};
use pursuit::toml::Table;
use pursuit::tracking::TrackerEntry;
use pursuit::{BBox, RunError};
use std::time::Instant;

/// Groups of parameters that can be changed while running.
const WHILE_RUNNING: [&str; 3] = ["motion", "policy", "search"];

impl Engine {
    pub(super) fn add(&mut self, bbox: BBox) -> Result<(), Refusal> {
        if self.targets().len() >= MOST_TARGETS {
            return Err(Refusal::too_many(format!("{MOST_TARGETS} targets are followed already; remove one")));
        }
        let target = self.last_target + 1;
        self.edit(EditKind::Add { target, bbox }, &format!("target {target} added"))?;
        self.last_target = target;
        Ok(())
    }

    /// The target is here in the frame that is shown; what comes before is put right too where that is wanted.
    pub(super) fn correct(&mut self, target: u64, bbox: BBox, backward: bool) -> Result<(), Refusal> {
        if backward && self.follower.info().live {
            return Err(Refusal::conflict("a live source cannot be followed backward; correct it without"));
        }
        let at = self.shown.index();
        if !self.follower.info().live && self.follower.began(at, target) {
            return self.begin_elsewhere(at, target, bbox);
        }
        self.edit(EditKind::Correct { target, bbox, backward }, &format!("target {target} corrected"))?;
        if backward { self.begin_return(target, bbox) } else { Ok(()) }
    }

    /// The target was begun here, and begins on this box instead.
    fn begin_elsewhere(&mut self, at: u64, target: u64, bbox: BBox) -> Result<(), Refusal> {
        self.may_follow()?;
        let (frame, row) = self.follower.begin_elsewhere(at, target, bbox)?;
        self.trajectory.branch(at, &format!("target {target} begun elsewhere"), self.tracker.name);
        self.trajectory.push(row);
        self.pictures.keep(&frame);
        let phase = if self.trajectory.len() > 1 { Phase::Paused } else { self.phase };
        (self.shown, self.phase, self.message, self.recorded) = (frame, phase, None, None);
        Ok(())
    }

    /// Does this in the frame that is shown; what was followed after it is followed again.
    pub(super) fn edit(&mut self, kind: EditKind, why: &str) -> Result<(), Refusal> {
        if self.follower.edits().len() >= MOST_EDITS {
            return Err(Refusal::too_many("this trial has been edited too often; open its source again"));
        }
        self.may_follow()?;
        let at = self.shown.index();
        if self.at_head() && self.phase != Phase::Failed && self.recorded.is_none() {
            let mut row = self.trajectory.last().map_or_else(|| Row::new(&self.shown, Vec::new()), |r| (**r).clone());
            let backward = matches!(kind, EditKind::Correct { backward: true, .. });
            self.follower.edit(kind, &mut row)?;
            if backward {
                // More than this frame changes: the trajectory as it was is kept.
                self.trajectory.branch(at + 1, why, self.tracker.name);
            }
            self.trajectory.replace_last(row);
            return Ok(());
        }
        if self.follower.info().live {
            return Err(Refusal::conflict("a live source cannot be followed again; go to its newest frame"));
        }
        let (frame, row) = self.follower.edit_at(at, kind)?;
        self.trajectory.branch(at, why, self.tracker.name);
        self.trajectory.push(row);
        self.pictures.keep(&frame);
        (self.shown, self.phase, self.message, self.recorded) = (frame, Phase::Paused, None, None);
        Ok(())
    }

    /// Names a target, and chooses its colour.
    pub(super) fn label(&mut self, target: u64, label: Label) -> Result<(), Refusal> {
        if !self.trajectory.rows().any(|row| row.records.iter().any(|r| r.target.0 == target)) {
            return Err(Refusal::missing(format!("there is no target {target}")));
        }
        let taken = |(other, own): (&u64, &Label)| *other != target && own.name.is_some() && own.name == label.name;
        if self.labels.iter().any(taken) {
            return Err(Refusal::conflict("another target has this name already"));
        }
        if label == Label::default() {
            self.labels.remove(&target)
        } else {
            self.labels.insert(target, label)
        };
        Ok(())
    }

    /// Changes parameters: at once where that can be done while running, else by following anew from the first frame.
    pub(super) fn change(&mut self, changes: &Table) -> Result<(), Refusal> {
        let mut changes = nested(changes);
        self.root.hold(&self.follower.recipe().schema(), &mut changes)?;
        let at_once = self.recorded.is_none() && changes.keys().all(|key| WHILE_RUNNING.contains(&key.as_str()));
        if at_once && self.trajectory.len() > 1 && !self.follower.targets().is_empty() {
            let mut row = self.trajectory.last().map_or_else(|| Row::new(&self.shown, Vec::new()), |r| (**r).clone());
            self.follower.edit(EditKind::Change { parameters: changes }, &mut row)?;
            self.trajectory.replace_last(row);
            return Ok(());
        }
        let parameters = self.follower.recipe().with(&changes).and_then(|r| r.parameters()).map_err(RunError::from)?;
        self.follow_anew(self.tracker, parameters, "a parameter changed")
    }

    /// Follows from the first frame with this method; what is said of the targets stays as it was.
    pub(super) fn follow_anew(
        &mut self,
        tracker: &'static TrackerEntry,
        parameters: Table,
        why: &str,
    ) -> Result<(), Refusal> {
        let begun = !self.follower.edits().is_empty() || self.follower.seeking().is_some();
        if self.follower.info().live && begun {
            return Err(Refusal::conflict(
                "a live source cannot be followed again with another method; open it once more",
            ));
        }
        self.may_follow()?;
        let recipe = tracker.recipe(&parameters).map_err(RunError::from)?;
        if self.follower.edits().is_empty() && self.follower.seeking().is_none() {
            self.follower.take_method(recipe);
            self.tracker = tracker;
            return Ok(());
        }
        // Changes while running were changes of the method that is given up.
        let kept = |e: &&Edit| !matches!(e.kind, EditKind::Change { .. });
        let edits = self.follower.edits().iter().filter(kept).cloned().collect();
        let old = self.tracker.name;
        let (base, before) = (self.follower.base().boxed_clone(), self.follower.edits().to_vec());
        self.recorded = None;
        let first = self.follower.restart(recipe, edits).and_then(|()| self.follower.step());
        let (frame, row) = match first {
            Ok(Some(first)) => first,
            Ok(None) => return Err(Refusal::unfit("this source has no frames any more")),
            Err(error) => {
                // The method cannot follow here, for lack of colour say; the one before goes on from the start.
                self.follower.restart(base, before)?;
                if let Some((frame, row)) = self.follower.step()? {
                    self.trajectory.branch(0, why, old);
                    self.trajectory.push(row);
                    (self.shown, self.phase) = (frame, Phase::Paused);
                }
                return Err(error.into());
            }
        };
        self.trajectory.branch(0, why, old);
        self.trajectory.push(row);
        self.pictures.keep(&frame);
        (self.tracker, self.shown, self.message) = (tracker, frame, None);
        if self.phase != Phase::Running {
            self.phase = if self.phase == Phase::Ready { Phase::Ready } else { Phase::Paused };
        }
        self.due = Instant::now();
        Ok(())
    }
}
