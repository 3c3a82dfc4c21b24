//! By choice: everything that a detector finds is followed, and one of it is said.

use super::super::target::failed;
use super::super::{
    AcquisitionParams, Associating, Clock, Elapsed, ManyParams, MultiTracker, RecipeOf, TargetId, Track,
};
use crate::belief::Belief;
use crate::motion::{CameraCompensation, CameraMotion, MotionFilter, MotionParams};
use crate::policy::PolicyParams;
use crate::{Detector, Estimate, Forecast, Measurement, Recipe, Result, TrackState, TrackingError, snapshot};
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_parameters::Parameters;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The name that errors and saved states bear.
const NAME: &str = "choosing";

/// Follows everything that a detector finds, and says one of it. Ids are its own: those of the followed would show that others
/// are followed too.
pub(super) struct Choosing {
    params: AcquisitionParams,
    recipe: Box<dyn Recipe>,
    everyone: Associating,
    known: Known,
}

/// What is said of whom, and saved.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
struct Known {
    /// The id of the one chosen, or of the next that will be; `None` once a user has removed it.
    sought: Option<TargetId>,
    chosen: Option<Chosen>,
    /// Those that users added: their ids, and their ids among all that are followed.
    given: Vec<(TargetId, TargetId)>,
    last_id: u64,
}

/// The one that is said.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Chosen {
    /// Its id among all that are followed.
    id: TargetId,
    /// How it moves by the tracker's own motion model, which predicts; association has a model of its own.
    belief: Belief,
    /// How long it has been lost, in seconds.
    lost_s: f64,
}

#[derive(Serialize, Deserialize)]
struct State {
    params: AcquisitionParams,
    /// Name and parameters (TOML).
    recipe: (String, String),
    everyone: Vec<u8>,
    known: Known,
}

impl Choosing {
    /// Seeks what `detector` finds; where nothing is detected, trackers of `recipe` look.
    pub fn new(
        clock: Arc<dyn Clock>,
        detector: Box<dyn Detector>,
        recipe: Box<dyn Recipe>,
        params: AcquisitionParams,
    ) -> Result<Self> {
        params.validate(NAME)?;
        // What models the scene says where something stands out of it, not with which chance it is a target.
        let mut many = ManyParams::counting(detector.motion().unwrap_or_else(|| ManyParams::default().motion));
        if motion(&*recipe)?.camera == CameraCompensation::Pose {
            // Before a head all that is followed moves with the picture.
            many.motion.camera = CameraCompensation::Pose;
        }
        let everyone = Associating::new(detector, many)?.timed_by(clock).with_appearance(recipe.boxed_clone());
        let known = Known { sought: Some(TargetId(1)), last_id: 1, ..Known::default() };
        Ok(Self { params, recipe, everyone, known })
    }

    /// As `save` left it.
    pub fn restore(
        clock: Arc<dyn Clock>,
        saved: &[u8],
        detector: Box<dyn Detector>,
        recipe_of: RecipeOf<'_>,
    ) -> Result<Self> {
        let problem = |problem: String| TrackingError::Snapshot { tracker: NAME.to_owned(), problem };
        let State { params, recipe, everyone, known } = snapshot::read(NAME, saved)?;
        let parameters = recipe.1.parse().map_err(|e: toml::de::Error| problem(e.to_string()))?;
        let recipe = recipe_of(&recipe.0)?.with(&parameters)?;
        let everyone = Associating::restore(&everyone, detector, recipe_of)?.timed_by(clock);
        let chosen = known.chosen.as_ref();
        if chosen.is_some_and(|c| !c.lost_s.is_finite() || !c.belief.last_believed.is_finite()) {
            return Err(problem("a time or a box is not a finite number".to_owned()));
        }
        Ok(Self { params, recipe, everyone, known })
    }

    pub const fn is_confirmed(&self) -> bool {
        self.known.sought.is_some() && self.known.chosen.is_some()
    }

    /// Leaves the one chosen where it has gone, or is lost while another is seen, and chooses another.
    fn choose(&mut self, frame: &Frame, tracks: &[Track]) -> Result<()> {
        let seen = |t: &&Track| t.estimate.as_ref().is_some_and(|e| e.state == TrackState::Tracking);
        let given = |t: &&Track| self.known.given.iter().any(|(_, inner)| *inner == t.id);
        let area = |t: &Track| t.estimate.as_ref().map_or(0.0, |e| e.bbox.area());
        let best = tracks.iter().filter(seen).filter(|t| !given(t)).max_by(|a, b| area(a).total_cmp(&area(b)));
        if let Some(chosen) = &self.known.chosen {
            let here = tracks.iter().any(|t| t.id == chosen.id);
            let waits = chosen.lost_s <= self.params.seek_again_after_s;
            if here && (waits || best.is_none()) {
                return Ok(());
            }
            self.known.chosen = None;
            self.known.last_id += 1;
            self.known.sought = Some(TargetId(self.known.last_id));
        }
        if let Some((id, estimate)) = best.and_then(|t| Some((t.id, t.estimate.as_ref()?))) {
            let belief = Belief::new(&motion(&*self.recipe)?, &PolicyParams::default(), frame, estimate.bbox);
            let belief = belief.map_err(|e| failed(frame.index(), e))?;
            self.known.chosen = Some(Chosen { id, belief, lost_s: 0.0 });
        }
        Ok(())
    }

    /// Keeps the tracks of the one chosen and of those that users added, under their own ids.
    fn keep(&self, tracks: &mut Vec<Track>) {
        let known = &self.known;
        let chosen = known.chosen.as_ref().map(|c| c.id).zip(known.sought).map(|(inner, outer)| (outer, inner));
        let named: Vec<(TargetId, TargetId)> = known.given.iter().copied().chain(chosen).collect();
        tracks.retain_mut(|t| match named.iter().find(|(_, inner)| *inner == t.id) {
            Some((outer, _)) => {
                t.id = *outer;
                true
            }
            None => false,
        });
        if let Some(id) = known.sought.filter(|_| known.chosen.is_none()) {
            let elapsed = Elapsed::default();
            tracks.push(Track { id, estimate: None, started: false, elapsed, class: None, detection: None });
        }
        tracks.sort_by_key(|t| t.id);
    }

    /// The id among all that are followed.
    fn inner(&self, id: TargetId) -> Result<TargetId> {
        let chosen = self.known.chosen.as_ref().filter(|_| self.known.sought == Some(id)).map(|c| c.id);
        let given = self.known.given.iter().find(|(outer, _)| *outer == id).map(|(_, inner)| *inner);
        chosen.or(given).ok_or(TrackingError::UnknownTarget { id: id.0 })
    }
}

/// How trackers of `recipe` model motion.
fn motion(recipe: &dyn Recipe) -> Result<MotionParams> {
    let parameters = recipe.parameters()?;
    let usual = MotionParams::default();
    match parameters.get("motion").and_then(toml::Value::as_table) {
        Some(own) => Ok(usual.with(NAME, own)?),
        None => Ok(usual),
    }
}

impl Chosen {
    /// Goes on to `frame`, in which `estimate` says where it is, and says what the tracker's motion model expects; the camera has `moved`
    /// the picture since the frame before.
    fn look(&mut self, frame: &Frame, moved: Option<&CameraMotion>, estimate: &mut Estimate) -> Result<()> {
        if let Some(shift) = moved.and_then(|moved| moved.at(self.belief.motion.bbox().center())) {
            self.belief.carry(shift);
        }
        let failed = |e| failed(frame.index(), e);
        let dt_s = self.belief.last.advance(frame)?;
        let prior = self.belief.predict(dt_s).map_err(failed)?;
        self.lost_s = if estimate.state == TrackState::Lost { self.lost_s + dt_s } else { 0.0 };
        if estimate.state == TrackState::Tracking {
            self.belief.believe(&Measurement::new(estimate.bbox, estimate.score), &[], false).map_err(failed)?;
            self.belief.last_believed = estimate.bbox;
        }
        self.belief.state = estimate.state;
        (estimate.prediction, estimate.next) = (Some(prior.bbox), self.belief.motion.next_sample());
        Ok(())
    }
}

impl MultiTracker for Choosing {
    fn step(&mut self, frame: &Frame, tracks: &mut Vec<Track>) -> Result<()> {
        self.everyone.step(frame, tracks)?;
        if self.known.sought.is_some() {
            if let Some(chosen) = &mut self.known.chosen
                && let Some(track) = tracks.iter_mut().find(|t| t.id == chosen.id)
                && let Some(estimate) = &mut track.estimate
            {
                chosen.look(frame, self.everyone.moved(), estimate)?;
            }
            let before = self.known.chosen.as_ref().map(|c| c.id);
            self.choose(frame, tracks)?;
            if let Some(chosen) = self.known.chosen.as_ref().filter(|c| Some(c.id) != before) {
                let new = tracks.iter_mut().filter(|t| t.id == chosen.id);
                new.for_each(|t| t.started = true);
            }
        }
        self.keep(tracks);
        Ok(())
    }

    fn add(&mut self, recipe: &dyn Recipe, frame: &Frame, bbox: BBox) -> Result<TargetId> {
        let inner = self.everyone.add(recipe, frame, bbox)?;
        self.known.last_id += 1;
        let id = TargetId(self.known.last_id);
        self.known.given.push((id, inner));
        Ok(id)
    }

    fn remove(&mut self, id: TargetId) -> Result<()> {
        if self.known.sought == Some(id) {
            (self.known.sought, self.known.chosen) = (None, None);
            return Ok(());
        }
        let inner = self.inner(id)?;
        self.known.given.retain(|(outer, _)| *outer != id);
        self.everyone.remove(inner)
    }

    /// A target that is still sought becomes one that the user points at.
    fn reinit(&mut self, id: TargetId, frame: &Frame, bbox: BBox) -> Result<()> {
        if self.known.sought != Some(id) || self.known.chosen.is_some() {
            let inner = self.inner(id)?;
            self.everyone.reinit(inner, frame, bbox)?;
        } else {
            let recipe = self.recipe.boxed_clone();
            let inner = self.everyone.add(&*recipe, frame, bbox)?;
            let belief = Belief::new(&motion(&*self.recipe)?, &PolicyParams::default(), frame, bbox);
            let belief = belief.map_err(|e| failed(frame.index(), e))?;
            self.known.chosen = Some(Chosen { id: inner, belief, lost_s: 0.0 });
        }
        if let Some(chosen) = self.known.chosen.as_mut().filter(|_| self.known.sought == Some(id)) {
            chosen.belief.restart(frame, bbox);
        }
        Ok(())
    }

    /// Changes how the one chosen is predicted, and the trackers of those that come later.
    fn change(&mut self, id: Option<TargetId>, changes: &toml::Table) -> Result<()> {
        if let Some(id) = id.filter(|id| self.known.sought != Some(*id)) {
            self.inner(id)?;
        }
        let recipe = self.recipe.with(changes)?;
        let before = std::mem::replace(&mut self.recipe, recipe);
        let changed = motion(&*self.recipe).and_then(|motion| match &mut self.known.chosen {
            Some(chosen) => chosen.belief.change(&motion, &PolicyParams::default()).map_err(|e| failed(0, e)),
            None => Ok(()),
        });
        match changed {
            Ok(()) => self.everyone.look_by(self.recipe.boxed_clone()),
            Err(error) => {
                self.recipe = before;
                return Err(error);
            }
        }
        Ok(())
    }

    fn forecast(&self, id: TargetId, seconds: f64) -> Result<Forecast> {
        match &self.known.chosen {
            Some(chosen) if self.known.sought == Some(id) => chosen.belief.forecast(seconds).map_err(|e| failed(0, e)),
            _ => self.everyone.forecast(self.inner(id)?, seconds),
        }
    }

    fn ids(&self) -> Vec<TargetId> {
        let mut ids: Vec<_> = self.known.given.iter().map(|(outer, _)| *outer).chain(self.known.sought).collect();
        ids.sort_unstable();
        ids
    }

    fn save(&self) -> Result<Vec<u8>> {
        let state = State {
            params: self.params.clone(),
            recipe: (self.recipe.name().to_owned(), self.recipe.parameters()?.to_string()),
            everyone: self.everyone.save()?,
            known: self.known.clone(),
        };
        snapshot::write(NAME, &state)
    }
}
