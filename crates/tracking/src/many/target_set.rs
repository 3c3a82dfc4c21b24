use super::{Clock, Elapsed, MultiTracker, RecipeOf, TargetId, Track, WallClock};
use crate::{Estimate, Forecast, Recipe, Result, Tracker, TrackingError, snapshot};
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The name that saved sets bear.
const NAME: &str = "target-set";

/// Several targets followed at once, each by its own tracker.
///
/// All share the planes derived from a frame and run on all cores; results do not depend on the number of threads.
/// Targets can be added and removed at any time; ids are handed out from 1 in order and stay.
pub struct TargetSet {
    targets: Vec<Entry>,
    last_id: u64,
    clock: Arc<dyn Clock>,
}

struct Entry {
    id: TargetId,
    tracker: Box<dyn Tracker>,
    /// What this step's update said, until it is reported.
    answer: Option<(Result<Estimate>, Elapsed)>,
}

impl Entry {
    fn new(id: TargetId, tracker: Box<dyn Tracker>) -> Self {
        Self { id, tracker, answer: None }
    }
}

impl Default for TargetSet {
    fn default() -> Self {
        Self::timed_by(Arc::new(WallClock::default()))
    }
}

impl TargetSet {
    /// No targets yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// No targets yet; what their updates take is told by `clock`.
    pub fn timed_by(clock: Arc<dyn Clock>) -> Self {
        Self { targets: Vec::new(), last_id: 0, clock }
    }

    /// Takes over a tracker that has been started or restored elsewhere.
    pub fn insert(&mut self, tracker: Box<dyn Tracker>) -> TargetId {
        let id = self.reserve();
        self.targets.push(Entry::new(id, tracker));
        id
    }

    /// Stops following a target and hands its tracker out.
    ///
    /// # Errors
    /// [`TrackingError::UnknownTarget`] when there is none of that id.
    pub fn take(&mut self, id: TargetId) -> Result<Box<dyn Tracker>> {
        let at = self.targets.iter().position(|t| t.id == id).ok_or(TrackingError::UnknownTarget { id: id.0 })?;
        Ok(self.targets.remove(at).tracker)
    }

    /// The tracker of a target; `None` when there is none of that id.
    pub fn get_mut(&mut self, id: TargetId) -> Option<&mut dyn Tracker> {
        let target = self.targets.iter_mut().find(|t| t.id == id)?;
        Some(&mut *target.tracker)
    }

    /// How many targets are followed.
    pub fn len(&self) -> usize {
        self.targets.len()
    }

    /// Whether none is.
    pub fn is_empty(&self) -> bool {
        self.targets.is_empty()
    }

    /// A set as [`save`](MultiTracker::save) left it; `recipe_of` knows the recipes of its trackers by name.
    ///
    /// # Errors
    /// Bytes that another version or nobody wrote, or a tracker that `recipe_of` does not know.
    pub fn restore(saved: &[u8], recipe_of: RecipeOf<'_>) -> Result<Self> {
        let saved: Saved = snapshot::read(NAME, saved)?;
        let mut set = Self { last_id: saved.last_id, ..Self::default() };
        for (id, tracker) in saved.targets {
            let recipe = recipe_of(snapshot::owner(&tracker)?)?;
            set.targets.push(Entry::new(id, recipe.restore(&tracker)?));
        }
        Ok(set)
    }

    /// Hands out an id without a target.
    pub(super) fn reserve(&mut self) -> TargetId {
        self.last_id += 1;
        TargetId(self.last_id)
    }

    /// Follows a tracker under an id that was reserved, in place of the one it may have had.
    pub(super) fn put(&mut self, id: TargetId, tracker: Box<dyn Tracker>) {
        match self.targets.binary_search_by_key(&id, |t| t.id) {
            Ok(at) => self.targets[at].tracker = tracker,
            Err(at) => self.targets.insert(at, Entry::new(id, tracker)),
        }
    }

    /// Whether there is a target of that id.
    pub fn contains(&self, id: TargetId) -> bool {
        self.targets.iter().any(|t| t.id == id)
    }

    fn known(&mut self, id: TargetId) -> Result<&mut Entry> {
        self.targets.iter_mut().find(|t| t.id == id).ok_or(TrackingError::UnknownTarget { id: id.0 })
    }
}

/// A set written down: each target with its tracker's own bytes.
#[derive(Serialize, Deserialize)]
#[serde(remote = "Saved")]
struct Saved {
    last_id: u64,
    targets: Vec<(TargetId, Vec<u8>)>,
}

pursuit_estimation::checked!(Saved);

impl Saved {
    fn restored(self) -> Result<Self, &'static str> {
        let ids: Vec<u64> = self.targets.iter().map(|(id, _)| id.0).collect();
        let in_order = ids.windows(2).all(|w| w[0] < w[1]);
        if !in_order || ids.iter().any(|id| !(1..=self.last_id).contains(id)) {
            return Err("its ids are not in order");
        }
        Ok(self)
    }
}

impl MultiTracker for TargetSet {
    fn step(&mut self, frame: &Frame, tracks: &mut Vec<Track>) -> Result<()> {
        tracks.clear();
        let clock = &*self.clock;
        let one = |target: &mut Entry| {
            target.answer = Some(Elapsed::of(clock, || target.tracker.update(frame)));
        };
        match self.targets.as_mut_slice() {
            // A single target is not worth waking other threads for.
            [target] => one(target),
            // One by one: on a busy machine threads are not equally fast.
            targets => targets.par_iter_mut().with_max_len(1).for_each(one),
        }
        for target in &mut self.targets {
            let Some((estimate, elapsed)) = target.answer.take() else { continue };
            tracks.push(Track {
                id: target.id,
                estimate: Some(estimate?),
                started: false,
                elapsed,
                class: None,
                detection: None,
            });
        }
        Ok(())
    }

    fn add(&mut self, recipe: &dyn Recipe, frame: &Frame, bbox: BBox) -> Result<TargetId> {
        let tracker = recipe.init(frame, bbox)?;
        Ok(self.insert(tracker))
    }

    fn remove(&mut self, id: TargetId) -> Result<()> {
        self.take(id).map(drop)
    }

    fn reinit(&mut self, id: TargetId, frame: &Frame, bbox: BBox) -> Result<()> {
        self.known(id)?.tracker.reinit(frame, bbox)
    }

    fn change(&mut self, id: Option<TargetId>, changes: &toml::Table) -> Result<()> {
        if let Some(id) = id {
            return self.known(id)?.tracker.change(changes);
        }
        // On copies first, so that an error changes none of them.
        let changed = self.targets.iter().map(|target| {
            let mut tracker = target.tracker.boxed_clone();
            tracker.change(changes)?;
            Ok(Entry::new(target.id, tracker))
        });
        self.targets = changed.collect::<Result<_>>()?;
        Ok(())
    }

    fn forecast(&self, id: TargetId, seconds: f64) -> Result<Forecast> {
        let target = self.targets.iter().find(|t| t.id == id).ok_or(TrackingError::UnknownTarget { id: id.0 })?;
        target.tracker.forecast(seconds)
    }

    fn ids(&self) -> Vec<TargetId> {
        self.targets.iter().map(|t| t.id).collect()
    }

    fn save(&self) -> Result<Vec<u8>> {
        let targets = self.targets.iter().map(|t| Ok((t.id, t.tracker.save()?))).collect::<Result<_>>()?;
        snapshot::write(NAME, &Saved { last_id: self.last_id, targets })
    }
}
