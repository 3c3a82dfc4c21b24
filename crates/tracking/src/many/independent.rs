use crate::{Estimate, Recipe, Result, Tracker, TrackingError};
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use rayon::prelude::*;

/// Identifies a target within its [`TargetSet`]; never reused there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TargetId(pub u64);

impl std::fmt::Display for TargetId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.fmt(f)
    }
}

/// Several targets followed at once, each by its own tracker.
///
/// All share the planes derived from a frame and run on all cores; results do not depend on the number of threads.
/// Targets can be added and removed at any time; ids are handed out from 1 in order and stay.
#[derive(Default)]
pub struct TargetSet {
    targets: Vec<(TargetId, Box<dyn Tracker>)>,
    last_id: u64,
}

impl TargetSet {
    /// No targets yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Starts following the target inside `bbox`.
    ///
    /// # Errors
    /// As [`Recipe::init`]; the set is then as before.
    pub fn add(&mut self, recipe: &dyn Recipe, frame: &Frame, bbox: BBox) -> Result<TargetId> {
        let tracker = recipe.init(frame, bbox)?;
        Ok(self.insert(tracker))
    }

    /// Takes over a tracker that has been started or restored elsewhere.
    pub fn insert(&mut self, tracker: Box<dyn Tracker>) -> TargetId {
        self.last_id += 1;
        let id = TargetId(self.last_id);
        self.targets.push((id, tracker));
        id
    }

    /// Stops following a target and hands its tracker out.
    ///
    /// # Errors
    /// [`TrackingError::UnknownTarget`] when there is none of that id.
    pub fn remove(&mut self, id: TargetId) -> Result<Box<dyn Tracker>> {
        let at = self.targets.iter().position(|(i, _)| *i == id).ok_or(TrackingError::UnknownTarget { id: id.0 })?;
        Ok(self.targets.remove(at).1)
    }

    /// The tracker of a target, to put it elsewhere ([`Tracker::reinit`]) or to save it; `None` when there is none of that id.
    pub fn get_mut(&mut self, id: TargetId) -> Option<&mut dyn Tracker> {
        let (_, tracker) = self.targets.iter_mut().find(|(i, _)| *i == id)?;
        Some(&mut **tracker)
    }

    /// How many targets are followed.
    pub fn len(&self) -> usize {
        self.targets.len()
    }

    /// Whether none is.
    pub fn is_empty(&self) -> bool {
        self.targets.is_empty()
    }

    /// The ids in the order they were added.
    pub fn ids(&self) -> impl Iterator<Item = TargetId> + '_ {
        self.targets.iter().map(|(id, _)| *id)
    }

    /// Looks at the next frame with every tracker; results in the order of [`ids`](Self::ids). `on_each` is called around
    /// nothing else than one tracker's update, so that callers can time it.
    pub fn update<T: Send>(
        &mut self,
        frame: &Frame,
        on_each: impl Fn(TargetId, &mut dyn FnMut() -> Result<Estimate>) -> T + Sync,
    ) -> Vec<T> {
        let one = |(id, tracker): &mut (TargetId, Box<dyn Tracker>)| on_each(*id, &mut || tracker.update(frame));
        match self.targets.as_mut_slice() {
            // A single target is not worth waking other threads for.
            [target] => vec![one(target)],
            // One by one: on a busy machine threads are not equally fast.
            targets => targets.par_iter_mut().with_max_len(1).map(one).collect(),
        }
    }
}
