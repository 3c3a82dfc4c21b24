//! One target that a detector finds.

mod choosing;
mod saved;
mod trials;

use super::{AcquisitionParams, Clock, MultiTracker, RecipeOf, TargetId, Track, WallClock};
use crate::{Detector, Forecast, Recipe, Result};
use choosing::Choosing;
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use std::sync::Arc;
use trials::Trials;

/// One target that a detector finds, in one of two ways.
///
/// *By choice*, where the detector models the scene and so sees every frame: everything that it finds is followed in the four
/// phases of [`Associating`](super::Associating), so that each region is a measurement of one target, and one of them is said. The
/// tracker's own motion model predicts it. When it has left or is gone another is chosen, which has another id.
///
/// *By trial*, with any other detector: whatever the detector sees first is followed at once, and so are its rivals, each by a
/// tracker of its own, while the detector is asked at every frame. A sequential probability ratio test weighs each hypothesis
/// against clutter: detected again where it is followed, and moving. The leader is what is reported. It is confirmed, or a rival
/// takes over, or it is lost and the search begins anew. A confirmed target is followed as any other; when it has been lost for
/// long, the detector is asked again.
pub struct Acquiring {
    way: Way,
}

/// How the one target is found.
enum Way {
    Trials(Box<Trials>),
    Choosing(Box<Choosing>),
}

impl Acquiring {
    /// Seeks what `detector` finds, to follow it by trackers of `recipe`.
    ///
    /// # Errors
    /// [`TrackingError::Parameter`](crate::TrackingError::Parameter) for a parameter out of range.
    pub fn new(detector: Box<dyn Detector>, recipe: Box<dyn Recipe>, params: AcquisitionParams) -> Result<Self> {
        Self::timed_by(Arc::new(WallClock::default()), detector, recipe, params)
    }

    /// The same; what the trackers take is told by `clock`.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn timed_by(
        clock: Arc<dyn Clock>,
        detector: Box<dyn Detector>,
        recipe: Box<dyn Recipe>,
        params: AcquisitionParams,
    ) -> Result<Self> {
        let way = if detector.watches() {
            Way::Choosing(Box::new(Choosing::new(clock, detector, recipe, params)?))
        } else {
            Way::Trials(Box::new(Trials::timed_by(clock, detector, recipe, params)?))
        };
        Ok(Self { way })
    }

    /// What the target may be while nothing is confirmed: boxes and their evidence in nats, the leader first. None of a target
    /// that is found by choice.
    pub fn hypotheses(&self) -> impl Iterator<Item = (BBox, f64)> + '_ {
        let trials = match &self.way {
            Way::Trials(trials) => Some(trials),
            Way::Choosing(_) => None,
        };
        trials.into_iter().flat_map(|t| t.hypotheses())
    }

    /// Whether the target is confirmed.
    pub fn is_confirmed(&self) -> bool {
        match &self.way {
            Way::Trials(trials) => trials.is_confirmed(),
            Way::Choosing(choosing) => choosing.is_confirmed(),
        }
    }

    /// As [`save`](MultiTracker::save) left it, with `detector` in place of the one it had: what a detector has learned is
    /// not saved. `recipe_of` knows the recipes of trackers by name.
    ///
    /// # Errors
    /// Bytes that another version or nobody wrote, or a tracker that `recipe_of` does not know.
    pub fn restore(saved: &[u8], detector: Box<dyn Detector>, recipe_of: RecipeOf<'_>) -> Result<Self> {
        let clock = Arc::new(WallClock::default());
        let way = if detector.watches() {
            Way::Choosing(Box::new(Choosing::restore(clock, saved, detector, recipe_of)?))
        } else {
            Way::Trials(Box::new(Trials::restore(clock, saved, detector, recipe_of)?))
        };
        Ok(Self { way })
    }

    fn way(&self) -> &dyn MultiTracker {
        match &self.way {
            Way::Trials(trials) => &**trials,
            Way::Choosing(choosing) => &**choosing,
        }
    }

    fn way_mut(&mut self) -> &mut dyn MultiTracker {
        match &mut self.way {
            Way::Trials(trials) => &mut **trials,
            Way::Choosing(choosing) => &mut **choosing,
        }
    }
}

impl MultiTracker for Acquiring {
    fn step(&mut self, frame: &Frame, tracks: &mut Vec<Track>) -> Result<()> {
        self.way_mut().step(frame, tracks)
    }

    fn add(&mut self, recipe: &dyn Recipe, frame: &Frame, bbox: BBox) -> Result<TargetId> {
        self.way_mut().add(recipe, frame, bbox)
    }

    fn remove(&mut self, id: TargetId) -> Result<()> {
        self.way_mut().remove(id)
    }

    fn reinit(&mut self, id: TargetId, frame: &Frame, bbox: BBox) -> Result<()> {
        self.way_mut().reinit(id, frame, bbox)
    }

    fn change(&mut self, id: Option<TargetId>, changes: &toml::Table) -> Result<()> {
        self.way_mut().change(id, changes)
    }

    fn forecast(&self, id: TargetId, seconds: f64) -> Result<Forecast> {
        self.way().forecast(id, seconds)
    }

    fn ids(&self) -> Vec<TargetId> {
        self.way().ids()
    }

    fn save(&self) -> Result<Vec<u8>> {
        self.way().save()
    }
}
