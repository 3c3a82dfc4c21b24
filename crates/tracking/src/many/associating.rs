use super::assignment::assign;
use super::target::{Belief, Target, failed};
use super::{AssociationParams, Clock, Elapsed, LastFrame, MultiTracker, RecipeOf, TargetId, Track, WallClock};
use crate::motion::Motion;
use crate::parameters::Parameters;
use crate::{
    Detection, Detector, Estimate, Followed, Forecast, Recipe, Result, TrackState, TrackingError, check_box, snapshot,
};
use pursuit_estimation::association::Assignment;
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The name that errors and saved states bear.
pub(super) const NAME: &str = "associating";

/// Follows whatever a detector finds, in four phases a frame: predict, associate, update, births and deaths.
///
/// The detector is asked at every frame. Detections are assigned to targets by global nearest neighbour: gated by the
/// innovation covariance of each target's motion model, cost minus twice the log-likelihood (Blackman and Popoli 1999,
/// chapter 6). What is left starts candidates, which become targets when they were detected in M of the last N frames;
/// only then they have an id. A target that is not detected is followed by its appearance, where a recipe was given, then
/// coasted, then lost, and given up in the end.
pub struct Associating {
    params: AssociationParams,
    detector: Box<dyn Detector>,
    appearance: Option<Box<dyn Recipe>>,
    targets: Vec<Target>,
    last_id: u64,
    last: Option<LastFrame>,
    clock: Arc<dyn Clock>,
    /// Targets × detections, row by row; scratch.
    costs: Vec<Option<f64>>,
    /// Keeps its memory from frame to frame.
    solver: Assignment,
    /// What the detector is told; scratch.
    followed: Vec<Followed>,
}

impl Associating {
    /// Nothing followed yet.
    ///
    /// # Errors
    /// [`TrackingError::Parameter`] for a parameter out of range.
    pub fn new(detector: Box<dyn Detector>, params: AssociationParams) -> Result<Self> {
        params.validate(NAME)?;
        Ok(Self {
            params,
            detector,
            appearance: None,
            targets: Vec::new(),
            last_id: 0,
            last: None,
            clock: Arc::new(WallClock::default()),
            costs: Vec::new(),
            solver: Assignment::new(),
            followed: Vec::new(),
        })
    }

    /// Every confirmed target gets a tracker of this recipe, which answers when no detection is associated.
    #[must_use]
    pub fn with_appearance(self, recipe: Box<dyn Recipe>) -> Self {
        Self { appearance: Some(recipe), ..self }
    }

    /// What the targets' work takes is told by `clock`.
    #[must_use]
    pub fn timed_by(self, clock: Arc<dyn Clock>) -> Self {
        Self { clock, ..self }
    }

    /// Its parameters.
    pub const fn params(&self) -> &AssociationParams {
        &self.params
    }

    /// Where candidates are that are not confirmed yet.
    pub fn candidates(&self) -> impl Iterator<Item = BBox> + '_ {
        self.targets.iter().filter(|t| t.belief.id.is_none()).map(Target::bbox)
    }

    /// As [`save`](MultiTracker::save) left it, with `detector` in place of the one it had: what a detector has learned is
    /// not saved. `recipe_of` knows the recipes of appearance trackers by name.
    ///
    /// # Errors
    /// Bytes that another version or nobody wrote, or a tracker that `recipe_of` does not know.
    pub fn restore(saved: &[u8], detector: Box<dyn Detector>, recipe_of: RecipeOf<'_>) -> Result<Self> {
        let saved: Saved = snapshot::read(NAME, saved)?;
        let mut restored = Self::new(detector, saved.params)?;
        if let Some((name, parameters)) = saved.appearance {
            let parameters = parameters.parse().map_err(|e: toml::de::Error| TrackingError::Snapshot {
                tracker: NAME.to_owned(),
                problem: e.to_string(),
            })?;
            restored.appearance = Some(recipe_of(&name)?.with(&parameters)?);
        }
        for (belief, appearance) in saved.targets {
            let appearance =
                appearance.map(|bytes| recipe_of(snapshot::owner(&bytes)?)?.restore(&bytes)).transpose()?;
            restored.targets.push(Target::of(belief, appearance));
        }
        (restored.last_id, restored.last) = (saved.last_id, saved.last);
        Ok(restored)
    }

    /// Phase 1: where every target should be now.
    fn predict(&mut self, frame: &Frame) -> Result<()> {
        let dt_s = LastFrame::advance(&mut self.last, frame)?;
        let params = &self.params;
        self.targets.iter_mut().try_for_each(|t| t.predict(dt_s, params)).map_err(|e| failed(frame.index(), e))
    }

    fn detect(&mut self, frame: &Frame) -> Result<Vec<Detection>> {
        self.followed.clear();
        let known = self.targets.iter().filter(|t| t.belief.id.is_some() && t.belief.state != TrackState::Lost);
        self.followed.extend(known.map(Target::followed));
        let mut detections = super::usable_detections(&mut *self.detector, frame, &self.followed)?;
        detections.retain(|d| d.confidence >= self.params.least_confidence);
        Ok(detections)
    }

    /// Phase 2: which detection is whose.
    fn associate(&mut self, frame: &Frame, detections: &[Detection]) -> Result<Vec<Option<usize>>> {
        if detections.is_empty() {
            return Ok(vec![None; self.targets.len()]);
        }
        self.costs.clear();
        for target in &self.targets {
            self.costs.extend(detections.iter().map(|d| target.cost(d, &self.params)));
        }
        assign(&mut self.solver, &self.costs, detections.len()).map_err(|e| failed(frame.index(), e))
    }

    /// Phase 3: every target takes its detection, or does without.
    fn update(&mut self, frame: &Frame, detections: &[Detection], of_target: &[Option<usize>]) -> Result<()> {
        let (params, clock) = (&self.params, &*self.clock);
        let one = |(target, detection): (&mut Target, &Option<usize>)| {
            let detection = detection.and_then(|d| detections.get(d));
            let (updated, elapsed) = Elapsed::of(clock, || target.update(frame, detection, params));
            if let Some((_, taken)) = &mut target.answer {
                *taken = elapsed;
            }
            updated
        };
        if self.targets.iter().filter(|t| t.appearance.is_some()).count() > 1 {
            self.targets.par_iter_mut().with_max_len(1).zip(of_target.par_iter()).try_for_each(one)
        } else {
            self.targets.iter_mut().zip(of_target).try_for_each(one)
        }
    }

    /// Phase 4: what is left starts candidates, candidates are confirmed, and what was not seen for long is given up.
    fn births_and_deaths(
        &mut self,
        frame: &Frame,
        detections: &[Detection],
        of_target: &[Option<usize>],
    ) -> Result<()> {
        let params = &self.params;
        self.targets.retain(|t| !t.is_dead(frame, params));
        for (i, detection) in detections.iter().enumerate() {
            let free = !of_target.contains(&Some(i));
            let alone = self.targets.iter().all(|t| t.bbox().iou(&detection.bbox) <= params.crowding);
            if free && alone && detection.confidence >= params.birth_from {
                let mut target = Target::new(detection.bbox, false, params).map_err(|e| failed(frame.index(), e))?;
                let estimate = Estimate::started(frame.time_s(), detection.bbox, detection.confidence);
                target.answer = Some((estimate, Elapsed::default()));
                target.count_class(detection);
                self.targets.push(target);
            }
        }
        for target in self.targets.iter_mut().filter(|t| t.belief.id.is_none()) {
            if target.is_confirmed(params) {
                self.last_id += 1;
                target.belief.id = Some(TargetId(self.last_id));
                let recipe = self.appearance.as_ref();
                target.appearance = recipe.map(|recipe| recipe.init(frame, target.bbox())).transpose()?;
            }
        }
        Ok(())
    }

    /// Says what is known of every target; those with ids above `known` are new.
    fn report(&mut self, known: u64, tracks: &mut Vec<Track>) {
        let figures = self.detector.diagnostics();
        for target in &mut self.targets {
            let Some(id) = target.belief.id else { continue };
            let Some((mut estimate, elapsed)) = target.answer.take() else { continue };
            estimate.diagnostics.extend(&figures);
            let started = id.0 > known;
            let class = target.belief.classes.most_likely().cloned();
            tracks.push(Track { id, estimate: Some(estimate), started, elapsed, class });
        }
        // Targets stand in order of their births; ids go by the order in which they were confirmed.
        tracks.sort_by_key(|t| t.id);
    }

    fn at(&self, id: TargetId) -> Result<usize> {
        let at = self.targets.iter().position(|t| t.belief.id == Some(id));
        at.ok_or(TrackingError::UnknownTarget { id: id.0 })
    }
}

impl MultiTracker for Associating {
    fn step(&mut self, frame: &Frame, tracks: &mut Vec<Track>) -> Result<()> {
        tracks.clear();
        let known = self.last_id;
        self.predict(frame)?;
        let detections = self.detect(frame)?;
        let of_target = self.associate(frame, &detections)?;
        self.update(frame, &detections, &of_target)?;
        self.births_and_deaths(frame, &detections, &of_target)?;
        self.report(known, tracks);
        Ok(())
    }

    /// The tracker of `recipe` answers when no detection is associated. A target that a user pointed at is never given up.
    fn add(&mut self, recipe: &dyn Recipe, frame: &Frame, bbox: BBox) -> Result<TargetId> {
        let appearance = recipe.init(frame, bbox)?;
        let mut target = Target::new(bbox, true, &self.params).map_err(|e| failed(frame.index(), e))?;
        self.last_id += 1;
        let id = TargetId(self.last_id);
        (target.belief.id, target.appearance) = (Some(id), Some(appearance));
        self.targets.push(target);
        self.last.get_or_insert_with(|| LastFrame::of(frame));
        Ok(id)
    }

    fn remove(&mut self, id: TargetId) -> Result<()> {
        let at = self.at(id)?;
        self.targets.remove(at);
        Ok(())
    }

    fn reinit(&mut self, id: TargetId, frame: &Frame, bbox: BBox) -> Result<()> {
        check_box(frame, bbox)?;
        let at = self.at(id)?;
        self.targets[at].put(frame, bbox)
    }

    /// Parameters of the group `[many]` belong to all targets at once, so `id` must be `None`.
    fn change(&mut self, id: Option<TargetId>, changes: &toml::Table) -> Result<()> {
        if let Some(id) = id {
            self.at(id)?;
            return Err(TrackingError::Parameter {
                owner: NAME.to_owned(),
                name: changes.keys().next().cloned().unwrap_or_default(),
                problem: "belongs to all targets together; change it for all".to_owned(),
            });
        }
        let params = self.params.with(NAME, changes)?;
        // The motion is tried on its own first, so that an error changes no target.
        for target in &self.targets {
            Motion::new(params.motion.clone(), target.bbox()).map_err(|e| failed(0, e))?;
        }
        self.targets.iter_mut().try_for_each(|t| t.change(&params)).map_err(|e| failed(0, e))?;
        self.params = params;
        Ok(())
    }

    fn forecast(&self, id: TargetId, seconds: f64) -> Result<Forecast> {
        let time_s = self.last.map_or(0.0, |l| l.time_s);
        self.targets[self.at(id)?].belief.motion.forecast(time_s, seconds).map_err(|e| failed(0, e))
    }

    fn ids(&self) -> Vec<TargetId> {
        let mut ids: Vec<_> = self.targets.iter().filter_map(|t| t.belief.id).collect();
        ids.sort_unstable();
        ids
    }

    fn save(&self) -> Result<Vec<u8>> {
        let appearance = self.appearance.as_ref();
        let appearance = appearance.map(|r| Ok((r.name().to_owned(), r.parameters()?.to_string()))).transpose()?;
        let target = |t: &Target| Ok((t.belief.clone(), t.appearance.as_ref().map(|a| a.save()).transpose()?));
        let targets = self.targets.iter().map(target).collect::<Result<_>>()?;
        let raw = Raw { params: self.params.clone(), appearance, targets, last_id: self.last_id, last: self.last };
        snapshot::write(NAME, &raw)
    }
}

/// The state written down: each target with its appearance tracker's own bytes.
#[derive(Serialize, Deserialize)]
struct Raw {
    params: AssociationParams,
    /// Name and parameters (TOML) of the recipe of appearance trackers.
    appearance: Option<(String, String)>,
    targets: Vec<(Belief, Option<Vec<u8>>)>,
    last_id: u64,
    last: Option<LastFrame>,
}

/// A [`Raw`] that has been checked.
#[derive(Deserialize)]
#[serde(try_from = "Raw")]
struct Saved {
    params: AssociationParams,
    appearance: Option<(String, String)>,
    targets: Vec<(Belief, Option<Vec<u8>>)>,
    last_id: u64,
    last: Option<LastFrame>,
}

impl TryFrom<Raw> for Saved {
    type Error = &'static str;

    fn try_from(raw: Raw) -> Result<Self, Self::Error> {
        let Raw { params, appearance, targets, last_id, last } = raw;
        let mut ids: Vec<u64> = targets.iter().filter_map(|(b, _)| b.id).map(|id| id.0).collect();
        ids.sort_unstable();
        if ids.windows(2).any(|w| w[0] == w[1]) || ids.iter().any(|id| !(1..=last_id).contains(id)) {
            return Err("two targets have one id, or an id was never handed out");
        }
        if !targets.iter().all(|(b, _)| b.is_sound()) || last.is_some_and(|l| !l.time_s.is_finite()) {
            return Err("a time or a box is not a finite number");
        }
        Ok(Self { params, appearance, targets, last_id, last })
    }
}
