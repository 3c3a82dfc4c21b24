//! A [`Session`] with the user's edits, and the way back to an earlier frame.

use super::snapshots::{Snapshot, Snapshots};
use super::{Edit, EditKind, Input, Row};
use crate::{Command, Remote, RunError, Session};
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_media::SourceInfo;
use pursuit_trackers::registry;
use pursuit_tracking::many::AcquisitionParams;
use pursuit_tracking::{Detector, DetectorEntry, Recipe, TargetId, TargetSet};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

/// A detector of the registry with its parameters.
#[derive(Debug, Clone)]
pub struct ChosenDetector {
    entry: &'static DetectorEntry,
    parameters: toml::Table,
}

impl ChosenDetector {
    /// The detector of this name; `parameters` are those that differ from the defaults.
    ///
    /// # Errors
    /// A name that there is not, parameters that do not fit.
    pub fn new(name: &str, parameters: toml::Table) -> Result<Self, RunError> {
        let chosen = Self { entry: registry::detector(name)?, parameters };
        chosen.detector()?;
        Ok(chosen)
    }

    /// Its name.
    pub const fn name(&self) -> &'static str {
        self.entry.name
    }

    /// A fresh one.
    ///
    /// # Errors
    /// A file that a parameter names and that cannot be read (any more).
    pub fn detector(&self) -> Result<Box<dyn Detector>, RunError> {
        Ok(self.entry.detector(&self.parameters)?)
    }

    /// Every parameter with its value.
    pub fn values(&self) -> toml::Table {
        self.entry.parameters(&self.parameters).unwrap_or_default()
    }
}

/// Follows targets frame by frame with what a user did, and again from an earlier frame.
pub struct EditedSession {
    input: Input,
    info: SourceInfo,
    /// The method as it is before any change while running.
    base: Box<dyn Recipe>,
    /// What finds the first target, where no box does.
    seeking: Option<ChosenDetector>,
    /// The method as it is now.
    recipe: Box<dyn Recipe>,
    session: Session,
    /// The numbers that users know targets by; a session that was begun again may hand out others.
    numbers: BTreeMap<TargetId, u64>,
    /// In order of their frames.
    edits: Vec<Edit>,
    /// How many of them have been obeyed.
    obeyed: usize,
    snapshots: Snapshots,
    /// The frame looked at last.
    at: Option<u64>,
}

impl EditedSession {
    /// Before the first frame. `seeking` finds the first target, where no box does; `edits` are in order of their frames.
    ///
    /// # Errors
    /// An input that cannot be read.
    pub fn new(
        input: Input,
        recipe: Box<dyn Recipe>,
        seeking: Option<ChosenDetector>,
        edits: Vec<Edit>,
    ) -> Result<Self, RunError> {
        let (source, info) = input.open(0)?;
        let mut session = Session::new(source, recipe.boxed_clone());
        if let Some(seeking) = &seeking {
            session = session.finding(seeking.detector()?, AcquisitionParams::default())?;
        }
        let numbers = session.targets().ids().into_iter().map(|id| (id, id.0)).collect();
        let (base, snapshots) = (recipe.boxed_clone(), Snapshots::default());
        Ok(Self { input, info, base, seeking, recipe, session, numbers, edits, obeyed: 0, snapshots, at: None })
    }

    /// From the first frame again, with this method and all edits.
    ///
    /// # Errors
    /// As [`new`](Self::new); nothing has changed then.
    pub fn restart(&mut self, recipe: Box<dyn Recipe>, edits: Vec<Edit>) -> Result<(), RunError> {
        *self = Self::new(self.input.clone(), recipe, self.seeking.clone(), edits)?;
        Ok(())
    }

    /// From the first frame again, in which this begins to look for a target.
    ///
    /// # Errors
    /// As [`new`](Self::new); nothing has changed then.
    pub fn seek(&mut self, seeking: ChosenDetector) -> Result<(), RunError> {
        *self = Self::new(self.input.clone(), self.base.boxed_clone(), Some(seeking), self.edits.clone())?;
        Ok(())
    }

    /// Takes other edits, as after an undo, and goes back to before the first that differs, where it has come past it: what was
    /// known there, or nearest before, is gone on from. With another method or another way to find the first target it begins anew.
    ///
    /// # Errors
    /// As [`new`](Self::new); nothing has changed then.
    pub fn revise(
        &mut self,
        recipe: Box<dyn Recipe>,
        seeking: Option<ChosenDetector>,
        edits: Vec<Edit>,
    ) -> Result<(), RunError> {
        let same = self.base.name() == recipe.name()
            && self.base.parameters()? == recipe.parameters()?
            && self.seeking.as_ref().map(|s| (s.name(), s.values()))
                == seeking.as_ref().map(|s| (s.name(), s.values()));
        if !same || self.info.live {
            *self = Self::new(self.input.clone(), recipe, seeking, edits)?;
            return Ok(());
        }
        let equal = self.edits.iter().zip(&edits).take_while(|(old, new)| old == new).count();
        let parts = [self.edits.get(equal), edits.get(equal)].into_iter().flatten().map(|e| e.frame).min();
        let before = std::mem::replace(&mut self.edits, edits);
        let Some(parts) = parts else { return Ok(()) };
        self.snapshots.forget_from(parts);
        if self.at.is_none_or(|at| at < parts) {
            return Ok(());
        }
        let back = match self.snapshots.last() {
            Some(snapshot) => self.resume(snapshot),
            None => self.restart(recipe, self.edits.clone()),
        };
        if back.is_err() {
            self.edits = before;
        }
        back
    }

    /// The frame looked at last; none before the first.
    pub const fn at(&self) -> Option<u64> {
        self.at
    }

    /// What finds the first target.
    pub const fn seeking(&self) -> Option<&ChosenDetector> {
        self.seeking.as_ref()
    }

    /// Takes another method for targets to come; there are none yet.
    pub fn take_method(&mut self, recipe: Box<dyn Recipe>) {
        (self.base, self.recipe) = (recipe.boxed_clone(), recipe);
    }

    /// What is known of the input.
    pub const fn info(&self) -> &SourceInfo {
        &self.info
    }

    /// The method as it was before any change while running.
    pub fn base(&self) -> &dyn Recipe {
        &*self.base
    }

    /// Stops the input where it waits for a frame that may never come.
    pub fn remote(&self) -> Remote {
        self.session.remote()
    }

    /// The method as it is now.
    pub fn recipe(&self) -> &dyn Recipe {
        &*self.recipe
    }

    /// What was done, in order of the frames.
    pub fn edits(&self) -> &[Edit] {
        &self.edits
    }

    /// The next frame, with what was edited in it; `None` after the last.
    ///
    /// # Errors
    /// An input that breaks off, a frame that the tracker cannot use.
    pub fn step(&mut self) -> Result<Option<(Arc<Frame>, Row)>, RunError> {
        let Some(progress) = self.session.step()? else { return Ok(None) };
        let (frame, mut records) = (progress.frame.clone(), progress.records.to_vec());
        self.at = Some(frame.index());
        for record in &mut records {
            if let Some(number) = self.numbers.get(&record.target) {
                record.target = TargetId(*number);
            }
        }
        records.sort_by_key(|r| r.target);
        let mut row = Row::new(&frame, records);
        while let Some(edit) = self.edits.get(self.obeyed).filter(|e| e.frame <= row.frame).cloned() {
            self.obey(&edit.kind, &mut row)?;
            self.obeyed += 1;
        }
        // What a detector has learnt of the scene cannot be written down.
        if !self.info.live && self.seeking.is_none() && self.snapshots.is_due(row.frame) {
            self.keep(row.frame);
        }
        Ok(Some((frame, row)))
    }

    /// Obeys an edit in the frame looked at last, whose row it changes.
    ///
    /// # Errors
    /// A box or a parameter that cannot be used, a target that there is not; nothing has changed then.
    pub fn edit(&mut self, kind: EditKind, row: &mut Row) -> Result<(), RunError> {
        self.obey(&kind, row)?;
        self.edits.insert(self.obeyed, Edit { frame: row.frame, kind });
        self.obeyed += 1;
        // What was written down of this frame is no longer so.
        self.snapshots.forget_from(row.frame);
        Ok(())
    }

    /// Goes back to frame `at`, obeys the edit in it, and keeps the edits of later frames for when they come again.
    ///
    /// # Errors
    /// As [`edit`](Self::edit), or an input that cannot be read a second time.
    pub fn edit_at(&mut self, at: u64, kind: EditKind) -> Result<(Arc<Frame>, Row), RunError> {
        let place = self.edits.partition_point(|e| e.frame <= at);
        self.edits.insert(place, Edit { frame: at, kind });
        match self.go_back(at) {
            Ok(found) => Ok(found),
            Err(error) => {
                self.edits.remove(place);
                // As it was, as far as the same input gives the same frames again.
                self.go_back(at)?;
                Err(error)
            }
        }
    }

    /// Goes back to frame `at`, in which the target was added, and adds it on another box in place of that one.
    ///
    /// # Errors
    /// A box that cannot be used, a target that was not added there, an input that cannot be read a second time; nothing has
    /// changed then.
    pub fn begin_elsewhere(&mut self, at: u64, target: u64, bbox: BBox) -> Result<(Arc<Frame>, Row), RunError> {
        let before = self.edits.clone();
        // Corrections of the same frame were of the box that is given up.
        self.edits
            .retain(|e| e.frame != at || !matches!(e.kind, EditKind::Correct { target: other, .. } if other == target));
        let added = self.edits.iter_mut().find_map(|e| match &mut e.kind {
            EditKind::Add { target: other, bbox } if *other == target && e.frame == at => Some(bbox),
            _ => None,
        });
        let Some(own) = added else {
            self.edits = before;
            return Err(RunError::usage(format!("target {target} was not added in frame {at}")));
        };
        *own = bbox;
        match self.go_back(at) {
            Ok(found) => Ok(found),
            Err(error) => {
                self.edits = before;
                self.go_back(at)?;
                Err(error)
            }
        }
    }

    /// Whether the target was added in this frame.
    pub fn began(&self, at: u64, target: u64) -> bool {
        let added =
            |e: &&Edit| e.frame == at && matches!(e.kind, EditKind::Add { target: other, .. } if other == target);
        self.edits.iter().any(|e| added(&e))
    }

    /// Follows again up to frame `at`, from the nearest frame before it whose state is known.
    fn go_back(&mut self, at: u64) -> Result<(Arc<Frame>, Row), RunError> {
        self.snapshots.forget_from(at);
        match self.snapshots.last() {
            Some(snapshot) => self.resume(snapshot)?,
            None => self.restart(self.base.boxed_clone(), self.edits.clone())?,
        }
        while let Some((frame, row)) = self.step()? {
            if row.frame >= at {
                return Ok((frame, row));
            }
        }
        Err(RunError::usage(format!("there is no frame {at}; the input has become shorter")))
    }

    fn resume(&mut self, snapshot: Snapshot) -> Result<(), RunError> {
        let (source, info) = self.input.open(snapshot.frame + 1)?;
        let recipe_of = |_: &str| Ok(snapshot.recipe.boxed_clone());
        let targets = TargetSet::restore(&snapshot.state, &recipe_of)?;
        self.session = Session::new(source, snapshot.recipe.boxed_clone()).following(Box::new(targets));
        (self.info, self.numbers, self.obeyed) = (info, snapshot.numbers, snapshot.obeyed);
        self.at = Some(snapshot.frame);
        self.recipe = snapshot.recipe;
        Ok(())
    }

    fn keep(&mut self, frame: u64) {
        // Without it, the way back is longer.
        let Ok(state) = self.session.targets().save() else { return };
        let (numbers, recipe) = (self.numbers.clone(), self.recipe.boxed_clone());
        self.snapshots.keep(Snapshot { frame, state, numbers, recipe, obeyed: self.obeyed });
    }

    fn obey(&mut self, kind: &EditKind, row: &mut Row) -> Result<(), RunError> {
        let began = Instant::now();
        match kind {
            EditKind::Add { target, bbox } => {
                let recipe = Some(self.recipe.boxed_clone());
                if let Some(id) = self.session.apply(Command::Add { bbox: *bbox, recipe })? {
                    self.numbers.insert(id, *target);
                }
                row.put(*target, *bbox, 1e3 * began.elapsed().as_secs_f64());
            }
            EditKind::Correct { target, bbox, .. } => {
                self.session.apply(Command::Reinit { target: self.id(*target), bbox: *bbox })?;
                row.put(*target, *bbox, 1e3 * began.elapsed().as_secs_f64());
            }
            EditKind::Remove { target } => {
                let id = self.id(*target);
                self.session.apply(Command::Remove(id))?;
                self.numbers.remove(&id);
                row.remove(*target);
            }
            EditKind::Change { parameters } => {
                let recipe = self.recipe.with(parameters)?;
                self.session.apply(Command::Change { target: None, parameters: parameters.clone() })?;
                self.recipe = recipe;
            }
        }
        Ok(())
    }

    /// The session's own id of a target; of one that there is not, an id that there is not.
    fn id(&self, number: u64) -> TargetId {
        self.numbers.iter().find(|(_, n)| **n == number).map_or(TargetId(u64::MAX), |(id, _)| *id)
    }

    /// The targets that are followed now.
    pub fn targets(&self) -> Vec<u64> {
        let mut numbers: Vec<u64> = self.numbers.values().copied().collect();
        numbers.sort_unstable();
        numbers
    }
}
