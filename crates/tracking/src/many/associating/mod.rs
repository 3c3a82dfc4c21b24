//! The four phases: predict, associate, update, births and deaths.

mod commands;
mod saved;

use super::association::{Association, Shares};
use super::target::{Standing, Target, failed};
use super::{Clock, Elapsed, ManyParams, RecipeOf, TargetId, Track, WallClock};
use crate::motion::CameraShift;
use crate::{Detection, Detector, Followed, Recipe, Result};
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_parameters::Parameters;
use rayon::prelude::*;
use std::sync::Arc;

/// The name that errors and saved states bear.
pub(super) const NAME: &str = "associating";

/// Follows whatever a detector finds, in four phases a frame: predict, associate, update, births and deaths.
///
/// The detector is asked at every frame. Which detection is of which target, when one that is of none becomes a target, and
/// when a target is given up, is said by the models that [`ManyParams`] name; only a target has an id. A target that is not
/// detected is followed by its appearance, where a recipe was given, then coasted, then lost, and given up in the end.
pub struct Associating {
    params: ManyParams,
    detector: Box<dyn Detector>,
    appearance: Option<Box<dyn Recipe>>,
    targets: Vec<Target>,
    last_id: u64,
    clock: Arc<dyn Clock>,
    /// Keeps its memory from frame to frame.
    association: Association,
    camera: CameraShift,
    /// Where the targets are; scratch.
    boxes: Vec<BBox>,
    /// What the detector is told; scratch.
    followed: Vec<Followed>,
}

impl Associating {
    /// Nothing followed yet.
    ///
    /// # Errors
    /// [`TrackingError::Parameter`](crate::TrackingError::Parameter) for a parameter out of range.
    pub fn new(detector: Box<dyn Detector>, params: ManyParams) -> Result<Self> {
        params.validate(NAME)?;
        Ok(Self {
            association: Association::new(params.association.clone()).map_err(|e| failed(0, e))?,
            camera: CameraShift::new(params.motion.camera),
            boxes: Vec::new(),
            params,
            detector,
            appearance: None,
            targets: Vec::new(),
            last_id: 0,
            clock: Arc::new(WallClock::default()),
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

    /// Targets that are confirmed later get a tracker of this recipe.
    pub(super) fn look_by(&mut self, recipe: Box<dyn Recipe>) {
        self.appearance = Some(recipe);
    }

    /// Its parameters.
    pub const fn params(&self) -> &ManyParams {
        &self.params
    }

    /// Where candidates are that are not confirmed yet.
    pub fn candidates(&self) -> impl Iterator<Item = BBox> + '_ {
        self.targets.iter().filter(|t| t.id().is_none()).map(Target::bbox)
    }

    /// As [`save`](super::MultiTracker::save) left it, with `detector` in place of the one it had: what a detector has learned
    /// is not saved. `recipe_of` knows the recipes of appearance trackers by name.
    ///
    /// # Errors
    /// Bytes that another version or nobody wrote, or a tracker that `recipe_of` does not know.
    pub fn restore(saved: &[u8], detector: Box<dyn Detector>, recipe_of: RecipeOf<'_>) -> Result<Self> {
        saved::restore(saved, detector, recipe_of)
    }

    /// Looks at the next frame.
    fn look(&mut self, frame: &Frame, tracks: &mut Vec<Track>) -> Result<()> {
        let known = self.last_id;
        self.predict(frame)?;
        let detections = self.detect(frame)?;
        self.associate(frame, &detections)?;
        self.update(frame, &detections)?;
        self.births_and_deaths(frame, &detections)?;
        self.report(known, tracks);
        Ok(())
    }

    /// Phase 1: where every target should be now; the camera's motion is taken out once for all.
    fn predict(&mut self, frame: &Frame) -> Result<()> {
        self.boxes.clear();
        self.boxes.extend(self.targets.iter().map(Target::bbox));
        if let Some(motion) = self.camera.look(frame, &self.boxes) {
            self.targets.iter_mut().for_each(|t| t.carry(&motion));
        }
        let params = &self.params;
        self.targets.iter_mut().try_for_each(|t| t.predict(frame, params))
    }

    fn detect(&mut self, frame: &Frame) -> Result<Vec<Detection>> {
        self.followed.clear();
        self.followed.extend(self.targets.iter().filter_map(Target::followed));
        let mut detections = super::usable_detections(&mut *self.detector, frame, &self.followed)?;
        detections.retain(|d| d.confidence >= self.params.association.least_confidence);
        for target in &mut self.targets {
            target.standing_out = self.detector.standing_out(&target.bbox());
        }
        Ok(detections)
    }

    /// Phase 2: which detection is of which target.
    fn associate(&mut self, frame: &Frame, detections: &[Detection]) -> Result<()> {
        let claimants: Option<Vec<_>> = self.targets.iter().map(Target::claimant).collect();
        let associated = self.association.associate(&claimants.unwrap_or_default(), detections, frame.size());
        associated.map_err(|e| failed(frame.index(), e))
    }

    /// Phase 3: every target takes what it was given, or does without.
    fn update(&mut self, frame: &Frame, detections: &[Detection]) -> Result<()> {
        let (params, clock, shares) = (&self.params, &*self.clock, self.association.shares());
        let one = |(target, shares): (&mut Target, &Shares)| {
            let (updated, elapsed) = Elapsed::of(clock, || target.update(frame, detections, shares, params));
            if let Some((_, taken)) = &mut target.answer {
                *taken = elapsed;
            }
            updated
        };
        if self.targets.iter().filter(|t| t.appearance.is_some()).count() > 1 {
            self.targets.par_iter_mut().with_max_len(1).zip(shares.par_iter()).try_for_each(one)
        } else {
            self.targets.iter_mut().zip(shares).try_for_each(one)
        }
    }

    /// Phase 4: what is left starts candidates, candidates are confirmed, and what was not seen for long is given up.
    fn births_and_deaths(&mut self, frame: &Frame, detections: &[Detection]) -> Result<()> {
        let params = &self.params;
        self.targets.retain(|t| !t.is_dead(frame, params));
        for (detection, _) in detections.iter().zip(self.association.left()).filter(|(_, left)| *left) {
            let alone = self.targets.iter().all(|t| t.bbox().iou(&detection.bbox) <= params.birth.crowding);
            if alone && detection.confidence >= params.birth.from {
                self.targets.push(Target::born(frame, detection, params).map_err(|e| failed(frame.index(), e))?);
            }
        }
        for target in self.targets.iter_mut().filter(|t| t.is_confirmed(params)) {
            self.last_id += 1;
            target.known.standing = Standing::Confirmed(TargetId(self.last_id));
            let recipe = self.appearance.as_ref();
            target.appearance = recipe.map(|recipe| recipe.appearance(frame, target.bbox())).transpose()?;
        }
        Ok(())
    }

    /// Says what is known of every target; those with ids above `known` are new.
    fn report(&mut self, known: u64, tracks: &mut Vec<Track>) {
        let figures = self.detector.diagnostics();
        tracks.clear();
        for target in &mut self.targets {
            let Some(id) = target.id() else { continue };
            let Some((mut estimate, elapsed)) = target.answer.take() else { continue };
            estimate.diagnostics.extend(figures.figures());
            let started = id.0 > known;
            let class = target.known.classes.most_likely().cloned();
            tracks.push(Track { id, estimate: Some(estimate), started, elapsed, class });
        }
        // Targets stand in order of their births; ids go by the order in which they were confirmed.
        tracks.sort_by_key(|t| t.id);
    }
}
