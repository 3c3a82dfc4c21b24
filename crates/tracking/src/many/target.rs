//! One target of [`Associating`](super::Associating), and what a frame does to it.

mod branching;
mod known;

pub(super) use known::{Known, Standing};

use super::association::{AssociationModel, Claimant, Expectation, GoesOn, Shares};
use super::birth::Evidence;
use super::branches::{Branch, Branches, Past};
use super::death::Unseen;
use super::look::Look;
use super::observed::{Observed, goes_again};
use super::whole::PartOf;
use super::{Elapsed, ManyParams, ReportedBox, TargetId};
use crate::belief::{Belief, Judgement, Stamp};
use crate::class::Classes;
use crate::motion::{CameraMotion, Motion, MotionFilter, Sight};
use crate::{Appearance, Detection, Estimate, Followed, Measurement, Prior, Result, Told, TrackState, TrackingError};
use pursuit_estimation::EstimationError;
use pursuit_geometry::{BBox, Point, Size};
use pursuit_imaging::Frame;

/// A frame as targets see it: pixels only where there are any.
#[derive(Clone, Copy)]
pub(super) struct View<'a> {
    pub stamp: Stamp,
    pub frame: Option<&'a Frame>,
}

impl<'a> From<&'a Frame> for View<'a> {
    fn from(frame: &'a Frame) -> Self {
        Self { stamp: frame.into(), frame: Some(frame) }
    }
}

/// A frame in which something was seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sighting {
    /// Number of the frame.
    pub index: u64,
    /// Place among the frame's detections.
    pub place: usize,
    pub bbox: BBox,
    pub confidence: f64,
}

/// A target or a candidate.
pub(super) struct Target {
    pub known: Known,
    /// Answers when no detection is associated.
    pub appearance: Option<Box<dyn Appearance>>,
    /// For how long that has followed it without losing it, in seconds.
    pub looked_at_s: f64,
    /// Share of where it should be that stands out of the scene, where the detector knows that.
    pub standing_out: Option<f64>,
    /// Whether it was given a region that takes it in and is larger than was expected of it.
    pub grown: bool,
    /// Time since the frame before, in seconds.
    pub dt_s: f64,
    /// What its motion model expects of this frame.
    prior: Option<Prior>,
    expectation: Option<Expectation>,
    /// Which of the frame's detections it was given.
    pub taken: Option<usize>,
    /// Where it was seen while it was a candidate.
    pub before: Vec<Sighting>,
    /// Whether it is a candidate that the best hypothesis knows nothing of.
    refuted: bool,
    /// What was said that it took in the last frames, and what is said now, where that differs.
    revised: Option<(Past, Past)>,
    /// What this frame said, until it is reported.
    pub answer: Option<Estimate>,
    /// How long the work on it took.
    pub elapsed: Elapsed,
    spare: Spare,
}

/// What is written into again, so that a frame takes no new memory.
struct Spare {
    /// The detections given, each with its probability.
    shared: Vec<(Sight, f64)>,
    /// A motion model that nobody needs.
    motion: Option<Box<Motion>>,
    /// Branches that nobody needs.
    branches: Vec<Branch>,
}

impl Target {
    /// A target or a candidate that was just seen at `bbox` of the frame of `stamp`.
    ///
    /// # Errors
    /// When the motion model cannot start from the box.
    pub fn new(standing: Standing, stamp: Stamp, bbox: BBox, params: &ManyParams) -> Result<Self, EstimationError> {
        let belief = Belief::new(&params.motion, &params.policy, stamp, bbox)?;
        let (classes, unseen) = (Classes::default(), Unseen::default());
        let (look, observed, part_of) = (Look::default(), Observed::default(), PartOf::default());
        let branches = Branches::default();
        let (undetected_s, empty_s) = (0.0, 0.0);
        let known =
            Known { standing, belief, classes, look, observed, unseen, undetected_s, empty_s, part_of, branches };
        Ok(Self::of(known, None))
    }

    /// A candidate that was detected once, at this place among the frame's detections.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn born(
        stamp: Stamp,
        (place, detection): (usize, &Detection),
        params: &ManyParams,
    ) -> Result<Self, EstimationError> {
        let mut evidence = Evidence::new(params.birth.model);
        evidence.look(Some(detection), &params.birth);
        let mut born = Self::new(Standing::Candidate(evidence), stamp, detection.bbox, params)?;
        born.answer = Some(Estimate::started(stamp.time_s, detection.bbox, detection.confidence));
        born.count_looks(detection);
        born.taken = Some(place);
        if params.association.model == AssociationModel::Hypotheses {
            born.known.branches = Branches::started(place);
        }
        Ok(born)
    }

    /// From what was saved.
    pub const fn of(known: Known, appearance: Option<Box<dyn Appearance>>) -> Self {
        Self {
            known,
            appearance,
            looked_at_s: 0.0,
            standing_out: None,
            grown: false,
            dt_s: 0.0,
            prior: None,
            expectation: None,
            taken: None,
            before: Vec::new(),
            refuted: false,
            revised: None,
            answer: None,
            elapsed: Elapsed { wall_ms: 0.0, thread_ms: 0.0 },
            spare: Spare { shared: Vec::new(), motion: None, branches: Vec::new() },
        }
    }

    /// Its id; `None` while it is a candidate.
    pub const fn id(&self) -> Option<TargetId> {
        self.known.id()
    }

    /// Where it is believed to be now.
    pub fn bbox(&self) -> BBox {
        self.known.belief.motion.bbox()
    }

    /// Whether it was given a detection in this frame.
    pub const fn is_seen(&self) -> bool {
        self.taken.is_some()
    }

    /// For how long it was not seen, in seconds.
    pub const fn unseen_s(&self) -> f64 {
        self.known.unseen.seconds
    }

    /// What a detector is told of it: nothing of candidates and of what is lost.
    pub fn followed(&self) -> Option<Followed> {
        let state = self.known.belief.state;
        let followed = self.id().is_some() && state != TrackState::Lost;
        followed.then(|| Followed { bbox: self.bbox(), measured: state == TrackState::Tracking })
    }

    /// The camera's motion moved the picture.
    pub fn carry(&mut self, motion: &CameraMotion) {
        let Some(shift) = motion.at(self.bbox().center()) else { return };
        self.known.belief.carry(shift);
        self.known.observed.carry(shift);
        self.known.branches.carry(shift);
        if let Some(appearance) = &mut self.appearance {
            appearance.carry(shift);
        }
    }

    /// Phase 1: where it should be in this frame.
    pub fn predict(&mut self, stamp: Stamp, params: &ManyParams) -> Result<()> {
        let dt_s = self.known.belief.last.advance(stamp)?;
        let is_looked_at = self.appearance.is_some() && self.followed().is_some();
        self.looked_at_s = if is_looked_at { self.looked_at_s + dt_s } else { 0.0 };
        let seen = self.known.unseen.frames == 0 && goes_again(&params.association);
        let now = &self.known.belief.motion;
        let kept = seen.then(|| match self.spare.motion.take() {
            Some(mut spare) => {
                spare.as_mut().clone_from(now);
                spare
            }
            None => Box::new(now.clone()),
        });
        self.known.observed.wait(kept);
        let failed = |e| failed(stamp.index, e);
        let prior = self.prior.insert(self.known.belief.predict(dt_s).map_err(failed)?);
        self.expectation = Some(Expectation::new(prior, &params.motion).map_err(failed)?);
        self.known.branches.predict(dt_s, &params.motion);
        self.known.look.wait(dt_s);
        self.grown = false;
        self.revised = None;
        Ok(())
    }

    /// Phase 2: what association knows of it, once it was predicted.
    pub fn claimant(&self) -> Option<Claimant<'_>> {
        let expectation = self.expectation.as_ref()?;
        let (confirmed, state) = (self.id().is_some(), self.known.belief.state);
        let unseen_s = self.known.unseen.seconds;
        let Known { classes, look, observed, branches, .. } = &self.known;
        Some(Claimant { expectation, confirmed, state, unseen_s, classes, look, observed, branches })
    }

    fn count_looks(&mut self, detection: &Detection) {
        if let Some(motion) = self.known.observed.see(detection.bbox) {
            self.spare.motion = Some(motion);
        }
        if let Some(class) = &detection.class {
            self.known.classes.count(class, detection.confidence);
        }
        if let Some(embedding) = &detection.embedding {
            self.known.look.learn(embedding);
        }
    }

    /// Phase 3: takes the detections that it was given, or what appearance says where there are none; its branches go on.
    pub fn update(
        &mut self,
        view: View<'_>,
        detections: &[Detection],
        (shares, goes_on): (&Shares, Option<GoesOn<'_>>),
        params: &ManyParams,
    ) -> Result<()> {
        let Some(dt_s) = self.prior.as_ref().map(|prior| prior.dt_s) else { return Ok(()) };
        self.dt_s = dt_s;
        if let Some(goes_on) = goes_on {
            self.branch(goes_on, detections, params.policy.lost_after_s);
        }
        let likeliest = shares.iter().reduce(|a, b| if b.1 > a.1 { b } else { a });
        self.taken = likeliest.map(|(d, _)| *d);
        let detection = self.taken.and_then(|d| detections.get(d));
        if let (Some(detection), [_], true) = (detection, shares.as_slice(), self.known.observed.keeps_motion()) {
            self.go_again(view.stamp, &detection.bbox)?;
        }
        self.count(detection, dt_s, params);
        let mut found = merged(detections, shares);
        found.iter_mut().for_each(|found| self.gate(found, params));
        let mut shared = std::mem::take(&mut self.spare.shared);
        share(detections, shares, &mut shared);
        let told = found.as_ref().map(|measurement| Told {
            measurement,
            shared: &shared,
            least_overlap: params.appearance_overlap,
        });
        let empty = detection.is_none() && self.standing_out.is_some_and(|share| share < params.death.empty_below);
        let Self { known, appearance, expectation, prior: Some(prior), answer, grown, spare, .. } = self else {
            return Ok(());
        };
        let Known { standing, belief, unseen, undetected_s, empty_s, .. } = known;
        *empty_s = if empty { *empty_s + dt_s } else { 0.0 };
        let believable = |seen: &Measurement| {
            // Sure enough, near its prediction, not for too long, where something is to be seen.
            let near = |e: &Expectation| e.admits(&seen.bbox, &params.association);
            let trusted = *undetected_s <= params.appearance_s && expectation.as_ref().is_some_and(near) && !empty;
            seen.confidence >= params.appearance_from && (matches!(standing, Standing::Given(_)) || trusted)
        };
        let estimate = match (appearance, view.frame) {
            (Some(appearance), Some(frame)) => {
                answer.insert(appearance.follow(frame, belief, prior, told.as_ref(), &believable)?)
            }
            (_, None) | (None, _) => {
                let judgement = conclude(view.stamp, belief, prior, told.as_ref())?;
                answer.insert(belief.report(view.stamp, prior, judgement, found.as_ref()))
            }
        };
        if *empty_s > params.death.empty_s && !matches!(standing, Standing::Given(_)) {
            // Nothing is there: it is not hidden.
            (estimate.state, estimate.score, belief.state) = (TrackState::Lost, 0.0, TrackState::Lost);
            estimate.mask = None;
        }
        if estimate.state == TrackState::Tracking {
            *unseen = Unseen::default();
            // Of several detections none is the target's for certain.
            if let (ReportedBox::Measured, [(_, _)], Some(seen)) = (params.reported, shares.as_slice(), &found) {
                estimate.bbox = seen.bbox;
                belief.last_believed = seen.bbox;
                if std::mem::take(grown) {
                    belief.motion.restart(seen.bbox);
                }
            }
        }
        spare.shared = shared;
        Ok(())
    }

    /// Takes the motion model through the gap before `bbox` again, where that is to be done: the target is then as one that was not lost.
    fn go_again(&mut self, stamp: Stamp, bbox: &BBox) -> Result<()> {
        let Self { known: Known { belief, observed, unseen, .. }, prior: Some(prior), .. } = self else {
            return Ok(());
        };
        let again = observed.again(bbox, unseen.seconds + prior.dt_s).map_err(|e| failed(stamp.index, e))?;
        if let Some((motion, expected)) = again {
            belief.motion = motion;
            *prior = Prior { dt_s: prior.dt_s, ..expected };
            if belief.state == TrackState::Lost {
                belief.state = TrackState::Occluded;
            }
        }
        Ok(())
    }

    /// Tells of a detection how far it is from the prediction.
    fn gate(&self, found: &mut Measurement, params: &ManyParams) {
        let share = |e: &Expectation| (e.distance2(&found.bbox) / params.association.gate).clamp(0.0, 1.0);
        let lost = self.known.belief.state == TrackState::Lost;
        found.gate_share = self.expectation.as_ref().filter(|_| !lost).map(share);
    }

    fn count(&mut self, detection: Option<&Detection>, dt_s: f64, params: &ManyParams) {
        detection.into_iter().for_each(|d| self.count_looks(d));
        let known = &mut self.known;
        if let Standing::Candidate(evidence) = &mut known.standing {
            evidence.look(detection, &params.birth);
        }
        known.undetected_s = if detection.is_some() { 0.0 } else { known.undetected_s + dt_s };
        known.unseen.wait(dt_s);
    }

    /// Phase 4: whether a candidate is a target, in the frame of this number.
    pub fn is_confirmed(&self, index: u64, params: &ManyParams) -> bool {
        let Standing::Candidate(evidence) = &self.known.standing else { return false };
        let starts = index < params.birth.at_start as u64;
        let counts = params.birth.hits.birth_counts || !self.known.observed.is_first();
        (starts && self.is_seen() && counts) || evidence.confirms(&params.birth)
    }

    /// Phase 4: whether it is to be given up.
    pub fn is_dead(&self, frame: Size, params: &ManyParams) -> bool {
        match &self.known.standing {
            Standing::Given(_) => false,
            Standing::Candidate(evidence) => self.refuted || evidence.refutes(self.known.unseen.frames, &params.birth),
            Standing::Confirmed(_) => {
                // A target that is lost where no picture is has left.
                let lost = self.known.belief.state == TrackState::Lost;
                let left = lost && self.bbox().clipped_to(frame).is_none();
                let empty_s = self.known.empty_s;
                let left_by_border =
                    empty_s > params.death.empty_s && at_border(&self.known.belief.last_believed, frame);
                let gone = left_by_border || empty_s > params.death.gone_s;
                let part = self.known.part_of.0 > params.whole.wait_s;
                left || gone || part || self.known.unseen.is_too_long(&params.death)
            }
        }
    }

    /// A user says where it is.
    pub fn put(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        if let Some(appearance) = &mut self.appearance {
            appearance.restart(frame, bbox)?;
        }
        self.known.belief.restart(frame, bbox);
        (self.known.classes, self.known.look) = (Classes::default(), Look::default());
        self.known.observed.clear();
        self.known.branches.clear();
        (self.known.unseen, self.known.undetected_s, self.known.empty_s) = (Unseen::default(), 0.0, 0.0);
        Ok(())
    }

    /// Goes on with other parameters; what speaks for a candidate begins anew where another model gathers it.
    pub fn change(&mut self, params: &ManyParams) -> Result<(), EstimationError> {
        self.known.belief.change(&params.motion, &params.policy)?;
        self.known.branches.clear();
        match &mut self.known.standing {
            Standing::Candidate(evidence) if evidence.model() != params.birth.model => {
                *evidence = Evidence::new(params.birth.model);
            }
            Standing::Candidate(_) | Standing::Confirmed(_) | Standing::Given(_) => {}
        }
        Ok(())
    }
}

/// Whether a box touches the border of the picture, or nearly.
fn at_border(bbox: &BBox, frame: Size) -> bool {
    let (width, height) = (frame.width as f64, frame.height as f64);
    let near = 0.01 * width.max(height);
    bbox.left() <= near || bbox.top() <= near || bbox.right() >= width - near || bbox.bottom() >= height - near
}

/// The policy's judgement of a target without appearance; what is believed of it is corrected.
fn conclude(stamp: Stamp, belief: &mut Belief, prior: &Prior, told: Option<&Told<'_>>) -> Result<Judgement> {
    let judgement = belief.judge(stamp.size, prior, told.map(|t| t.measurement), false, || None);
    if let Some(told) = told.filter(|_| judgement.0.state == TrackState::Tracking) {
        belief.believe(told.measurement, told.shared, false).map_err(|e| failed(stamp.index, e))?;
    }
    Ok(judgement)
}

/// The one measurement that stands for all detections given: their mean by probability.
fn merged(detections: &[Detection], shares: &Shares) -> Option<Measurement> {
    let given = || shares.iter().filter_map(|(d, p)| Some((detections.get(*d)?, *p)));
    if let [(d, _)] = shares.as_slice() {
        return detections.get(*d).map(|d| Measurement::new(d.bbox, d.confidence));
    }
    let total: f64 = given().map(|(_, p)| p).sum();
    let mean = |of: fn(&Detection) -> f64| given().map(|(d, p)| p * of(d)).sum::<f64>() / total;
    let center = Point::new(mean(|d| d.bbox.center().x), mean(|d| d.bbox.center().y));
    let bbox = BBox::from_center_size(center, mean(|d| d.bbox.width()), mean(|d| d.bbox.height()));
    (total > 0.0).then(|| Measurement::new(bbox, mean(|d| d.confidence)))
}

/// Lists the detections given, each with its probability, where that is not one detection for certain.
fn share(detections: &[Detection], shares: &Shares, shared: &mut Vec<(Sight, f64)>) {
    shared.clear();
    if !matches!(shares.as_slice(), [] | [(_, 1.0)]) {
        shared.extend(shares.iter().filter_map(|(d, p)| Some((Sight::of(detections.get(*d)?.bbox, None), *p))));
    }
}

/// Says of an error of the motion model where it happened.
pub(super) fn failed(index: u64, source: EstimationError) -> TrackingError {
    crate::belief::failed(super::associating::NAME, index, source)
}
