//! The four phases: predict, associate, update, births and deaths.

mod commands;
mod fed;
mod led;
mod looks;
mod saved;
mod telling;

use super::association::{Association, AssociationModel, Claimant, Shares, emptied};
use super::cells::Cells;
use super::target::{Sighting, Standing, Target, View, failed};
use super::{Clock, Elapsed, ManyParams, RecipeOf, TargetId, Track, WallClock, doubles, whole};
use crate::belief::Stamp;
use crate::motion::{CameraMotion, CameraShift};
use crate::{Detection, Detector, Embedder, Followed, Recipe, Result};
use fed::Fed;
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_parameters::{ParameterError, Parameters};
use rayon::prelude::*;
use std::sync::Arc;

/// The name that errors and saved states bear.
pub(super) const NAME: &str = "associating";

/// Follows whatever a detector finds, in four phases a frame: predict, associate, update, births and deaths.
///
/// Detections come from outside, frame by frame, without pixels ([`update`](Self::update)) or with them
/// ([`update_in`](Self::update_in)); or a detector is asked at every frame ([`new`](Self::new) and
/// [`MultiTracker::step`](super::MultiTracker::step)).
///
/// ```
/// use pursuit_geometry::{BBox, Size};
/// use pursuit_tracking::Detection;
/// use pursuit_tracking::many::{Associating, ManyParams};
///
/// let mut many = Associating::fed(ManyParams::default())?;
/// for k in 0..20 {
///     let walker = BBox::from_ltwh(100.0 + 3.0 * f64::from(k), 80.0, 40.0, 90.0);
///     let seen = [Detection::new(walker, 0.9)];
///     for track in many.update(f64::from(k) / 25.0, Some(Size::new(640, 480)), &seen)? {
///         println!("{} is detection {:?}: {:?}", track.id, track.detection, track.estimate);
///     }
/// }
/// assert_eq!(many.last_id(), 1);
/// # Ok::<(), pursuit_tracking::TrackingError>(())
/// ```
/// Which detection is of which target, when one that is of none becomes a target, and
/// when a target is given up, is said by the models that [`ManyParams`] name; only a target has an id. A target that is not
/// detected is followed by its appearance, where a recipe was given, then coasted, then lost, and given up in the end.
pub struct Associating {
    params: ManyParams,
    /// `None` where detections come from outside.
    detector: Option<Box<dyn Detector>>,
    appearance: Option<Box<dyn Recipe>>,
    /// Says what detections look like.
    embedder: Option<Box<dyn Embedder>>,
    targets: Vec<Target>,
    last_id: u64,
    clock: Arc<dyn Clock>,
    /// Keeps its memory from frame to frame.
    association: Association,
    claimants: Vec<Claimant<'static>>,
    camera: CameraShift,
    /// How the camera's motion moved the picture into the last frame.
    moved: Option<CameraMotion>,
    /// Where the targets are, also in cells; scratch.
    boxes: Vec<BBox>,
    cells: Cells,
    /// The detections that may start candidates, by their places; these in cells; and of each whether it has started one; scratch.
    births: Vec<usize>,
    newborn: Cells,
    is_born: Vec<bool>,
    /// What the detector is told; scratch.
    followed: Vec<Followed>,
    /// The detections that are sure enough, and their places among all; scratch.
    kept: Vec<Detection>,
    places: Vec<usize>,
    /// Where those confirmed in this frame were seen before.
    back_dated: Vec<(TargetId, Sighting)>,
    /// The targets by their ids, and their places; scratch.
    order: Vec<(TargetId, usize)>,
    /// What was said of detections from outside.
    said: Vec<Track>,
    /// Number and time of the last frame that came from outside.
    fed: Fed,
}

/// The detections that are sure enough, and their places among all.
pub(super) fn usable(least: f64, detections: &[Detection]) -> impl Iterator<Item = (usize, &Detection)> {
    detections.iter().enumerate().filter(move |(_, d)| d.confidence >= least && !d.bbox.is_empty())
}

/// Gives detections to targets as `params` say, looks weighed by what says them.
///
/// # Errors
/// Where the model of association does not ask for looks that are to be made.
fn association(params: &ManyParams) -> Result<Association> {
    let weighs_looks = match params.association.model {
        AssociationModel::Nearest | AssociationModel::Hypotheses => true,
        AssociationModel::TwoStage
        | AssociationModel::Buffered
        | AssociationModel::Observation
        | AssociationModel::Joint => false,
    };
    if params.embedding.even().is_some() && !weighs_looks {
        let why =
            "is read by the models of association `nearest` and `hypotheses` alone; choose one of these, or `none`";
        return Err(ParameterError::new("many", "embedding.model", why).into());
    }
    let mut own = params.association.clone();
    own.nearest.look_even = params.embedding.even().unwrap_or(own.nearest.look_even);
    Association::new(own).map_err(|e| failed(0, e))
}

impl Associating {
    /// Nothing followed yet.
    ///
    /// # Errors
    /// [`TrackingError::Parameter`](crate::TrackingError::Parameter) for a parameter out of range.
    pub fn new(detector: Box<dyn Detector>, params: ManyParams) -> Result<Self> {
        Ok(Self { detector: Some(detector), ..Self::fed(params)? })
    }

    /// Nothing followed yet; detections come from outside, by [`update`](Self::update) or [`update_in`](Self::update_in).
    ///
    /// # Errors
    /// [`TrackingError::Parameter`](crate::TrackingError::Parameter) for a parameter out of range.
    pub fn fed(params: ManyParams) -> Result<Self> {
        params.validate(NAME)?;
        Ok(Self {
            association: association(&params)?,
            claimants: Vec::new(),
            camera: CameraShift::new(params.motion.camera),
            moved: None,
            boxes: Vec::new(),
            cells: Cells::default(),
            births: Vec::new(),
            newborn: Cells::default(),
            is_born: Vec::new(),
            params,
            detector: None,
            appearance: None,
            embedder: None,
            targets: Vec::new(),
            last_id: 0,
            clock: Arc::new(WallClock::default()),
            followed: Vec::new(),
            kept: Vec::new(),
            places: Vec::new(),
            back_dated: Vec::new(),
            order: Vec::new(),
            said: Vec::new(),
            fed: Fed::default(),
        })
    }

    /// Every confirmed target gets a tracker of this recipe, which answers when no detection is associated.
    #[must_use]
    pub fn with_appearance(self, recipe: Box<dyn Recipe>) -> Self {
        Self { appearance: Some(recipe), ..self }
    }

    /// What detections look like is asked of `embedder` where it decides whose they are: of those without an embedding, in frames with
    /// pixels.
    #[must_use]
    pub fn with_embedder(self, embedder: Option<Box<dyn Embedder>>) -> Self {
        Self { embedder, ..self }
    }

    /// What the targets' work takes is told by `clock`.
    #[must_use]
    pub fn timed_by(self, clock: Arc<dyn Clock>) -> Self {
        Self { clock, ..self }
    }

    /// How the camera's motion moved the picture into the last frame, where that was asked for and can be told.
    pub(super) const fn moved(&self) -> Option<&CameraMotion> {
        self.moved.as_ref()
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
        Ok(Self { detector: Some(detector), ..saved::restore(saved, recipe_of)? })
    }

    /// As [`save`](super::MultiTracker::save) left it; detections come from outside.
    ///
    /// # Errors
    /// As [`restore`](Self::restore).
    pub fn restore_fed(saved: &[u8], recipe_of: RecipeOf<'_>) -> Result<Self> {
        saved::restore(saved, recipe_of)
    }

    /// The highest id handed out so far; 0 where there was none.
    pub const fn last_id(&self) -> u64 {
        self.last_id
    }

    /// Looks at the next frame.
    fn look(&mut self, frame: &Frame, tracks: &mut Vec<Track>) -> Result<()> {
        self.predict(frame.into())?;
        let detections = self.detect(frame)?;
        // What stands out of the scene is found once, and shown to all who look; so is the picture coarser.
        let shown = self.detector.as_mut().filter(|_| self.appearance.is_some()).and_then(|d| d.shown(frame));
        self.take(shown.as_ref().unwrap_or(frame).into(), &detections, tracks)
    }

    /// Phases 2 to 4, once targets were predicted.
    fn take(&mut self, view: View<'_>, detections: &[Detection], tracks: &mut Vec<Track>) -> Result<()> {
        let known = self.last_id;
        let least = self.params.association.least_confidence;
        let (mut kept, mut places) = (std::mem::take(&mut self.kept), std::mem::take(&mut self.places));
        kept.clear();
        places.clear();
        for (place, detection) in usable(least, detections) {
            kept.push(detection.clone());
            places.push(place);
        }
        let asked = view.frame.map_or(Ok(()), |frame| self.embed(frame, &mut kept));
        let taken = asked.and_then(|()| self.conclude(view, &kept));
        (self.kept, self.places) = (kept, places);
        taken?;
        self.remember(view.stamp.index, known);
        self.report(known, tracks);
        Ok(())
    }

    fn conclude(&mut self, view: View<'_>, detections: &[Detection]) -> Result<()> {
        self.associate(view.stamp, detections)?;
        self.correct(view, detections)?;
        self.births_and_deaths(view, detections)
    }

    /// Phase 1: where every target should be now; the camera's motion is taken out once for all.
    fn predict(&mut self, view: View<'_>) -> Result<()> {
        if let Some(frame) = view.frame {
            self.boxes.clear();
            self.boxes.extend(self.targets.iter().map(Target::bbox));
            self.moved = self.camera.look(frame, &self.boxes);
            if let Some(motion) = &self.moved {
                self.targets.iter_mut().for_each(|t| t.carry(motion));
            }
        }
        let params = &self.params;
        self.targets.iter_mut().try_for_each(|t| t.predict(view.stamp, params))
    }

    fn detect(&mut self, frame: &Frame) -> Result<Vec<Detection>> {
        self.followed.clear();
        self.followed.extend(self.targets.iter().filter_map(Target::followed));
        let Some(detector) = &mut self.detector else { return Ok(Vec::new()) };
        let mut detections = super::usable_detections(&mut **detector, frame, &self.followed)?;
        if !detector.measures() && led::goes_on(&self.targets) {
            detections.clear();
        }
        for target in &mut self.targets {
            target.standing_out = detector.standing_out(&target.bbox());
        }
        Ok(detections)
    }

    /// Phase 2: which detection is of which target.
    fn associate(&mut self, stamp: Stamp, detections: &[Detection]) -> Result<()> {
        // Every target was predicted, and so is one.
        let mut claimants: Vec<Claimant<'_>> = std::mem::take(&mut self.claimants);
        claimants.extend(self.targets.iter().filter_map(Target::claimant));
        let associated = self.association.associate(&claimants, detections, stamp.size);
        self.claimants = emptied(claimants);
        associated.map_err(|e| failed(stamp.index, e))?;
        if self.knows_scene() {
            whole::grow(&mut self.association, &mut self.targets, detections, &self.params.whole);
        }
        Ok(())
    }

    /// Whether the detector models the scene, so that what it finds are regions of it.
    fn knows_scene(&self) -> bool {
        self.detector.as_ref().is_some_and(|d| d.watches())
    }

    /// Phase 3: every target takes what it was given, or does without.
    fn correct(&mut self, view: View<'_>, detections: &[Detection]) -> Result<()> {
        let (params, clock, association) = (&self.params, &*self.clock, &self.association);
        let shares = association.shares();
        let update = |(at, (target, shares)): (usize, (&mut Target, &Shares))| {
            target.update(view, detections, (shares, association.goes_on(at)), params)
        };
        let timed = |(at, (target, shares)): (usize, (&mut Target, &Shares))| {
            let (updated, elapsed) = Elapsed::of(clock, || update((at, (&mut *target, shares))));
            target.elapsed = elapsed;
            updated
        };
        match self.targets.iter().filter(|t| t.appearance.is_some()).count() {
            0 => {
                // Numbers alone take a target less than two looks at the clock do: the time is taken of all, and each has its share.
                let all = || self.targets.iter_mut().zip(shares).enumerate().try_for_each(update);
                let (updated, elapsed) = Elapsed::of(clock, all);
                updated?;
                let each = elapsed.shared_by(self.targets.len());
                self.targets.iter_mut().for_each(|target| target.elapsed = each);
            }
            1 => self.targets.iter_mut().zip(shares).enumerate().try_for_each(timed)?,
            _ => {
                let targets = self.targets.par_iter_mut().with_max_len(1);
                targets.zip(shares.par_iter()).enumerate().try_for_each(timed)?;
            }
        }
        if self.knows_scene() {
            whole::count_parts(&mut self.targets, detections, &self.params.whole);
        }
        Ok(())
    }

    /// Phase 4: what is left starts candidates, candidates are confirmed, and what was not seen for long is given up.
    fn births_and_deaths(&mut self, view: View<'_>, detections: &[Detection]) -> Result<()> {
        let params = &self.params;
        self.targets.retain(|t| !t.is_dead(view.stamp.size, params));
        doubles::merge(&mut self.targets, &params.doubles);
        self.births.clear();
        let left = detections.iter().zip(self.association.left()).enumerate();
        let starts = left.filter(|(_, (d, left))| *left && d.confidence >= params.birth.from).map(|(place, _)| place);
        self.births.extend(starts);
        if !self.births.is_empty() {
            self.boxes.clear();
            self.boxes.extend(self.targets.iter().map(Target::bbox));
            self.cells.fill(self.boxes.iter());
            self.newborn.fill(self.births.iter().map(|place| &detections[*place].bbox));
        }
        self.is_born.clear();
        for (nth, &place) in self.births.iter().enumerate() {
            let detection = &detections[place];
            let own = &detection.bbox;
            let range = [own.left(), own.top(), own.right(), own.bottom()];
            let crowds = |other: &BBox| other.iou(own) > params.birth.crowding;
            let mut crowded = false;
            self.cells.near(&range, 0.0, |target| crowded = crowded || crowds(&self.boxes[target]));
            // Those born before it in this frame are targets too.
            self.newborn.near(&range, 0.0, |other| {
                crowded =
                    crowded || (other < nth && self.is_born[other] && crowds(&detections[self.births[other]].bbox));
            });
            self.is_born.push(!crowded);
            if !crowded {
                let born = Target::born(view.stamp, (place, detection), params);
                self.targets.push(born.map_err(|e| failed(view.stamp.index, e))?);
            }
        }
        let index = view.stamp.index;
        for target in self.targets.iter_mut().filter(|t| t.is_confirmed(index, params)) {
            self.last_id += 1;
            target.known.standing = Standing::Confirmed(TargetId(self.last_id));
            if let (Some(recipe), Some(frame)) = (&self.appearance, view.frame) {
                target.appearance = Some(recipe.appearance(frame, target.bbox())?);
            }
        }
        Ok(())
    }
}
