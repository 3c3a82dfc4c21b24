//! One target of [`Associating`](super::Associating): its belief, and what a frame does to it.

use super::assignment::Expectation;
use super::{AssociationParams, Elapsed, TargetId};
use crate::class::Classes;
use crate::motion::{Motion, MotionFilter, Sight};
use crate::policy::{Evidence, Policy};
use crate::roles::{Measurement, Prior};
use crate::{Detection, Diagnostics, Estimate, Followed, Result, TrackState, Tracker, TrackingError};
use pursuit_estimation::EstimationError;
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use serde::{Deserialize, Serialize};

/// What is believed of a target, and how it came to be believed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Belief {
    /// Its id; `None` while it is a candidate.
    pub id: Option<TargetId>,
    pub motion: Motion,
    policy: Policy,
    pub state: TrackState,
    /// What its detections were taken for.
    pub classes: Classes,
    last_believed: BBox,
    /// Whether it was detected, a bit a frame, the last frame in the lowest.
    history: u64,
    /// Frames since its birth.
    looks: u64,
    /// Time since it was measured by anything, in seconds.
    unseen_s: f64,
    /// Time since it was detected, in seconds.
    undetected_s: f64,
    /// Whether a user pointed at it: then nothing but a user gives it up.
    given: bool,
}

impl Belief {
    /// Whether it can be a belief: what is restored is checked.
    pub fn is_sound(&self) -> bool {
        let time = |s: f64| s.is_finite() && s >= 0.0;
        time(self.unseen_s) && time(self.undetected_s) && self.last_believed.is_finite() && self.classes.is_sound()
    }
}

/// A target or a candidate.
pub(super) struct Target {
    pub belief: Belief,
    /// Answers when no detection is associated.
    pub appearance: Option<Box<dyn Tracker>>,
    /// What its motion model expects of this frame.
    prior: Option<Prior>,
    expectation: Option<Expectation>,
    /// What this frame said, until it is reported.
    pub answer: Option<(Estimate, Elapsed)>,
}

impl Target {
    /// A candidate that was detected once, or (`given`) a target that a user pointed at.
    pub fn new(bbox: BBox, given: bool, params: &AssociationParams) -> Result<Self, EstimationError> {
        let belief = Belief {
            id: None,
            motion: Motion::new(params.motion.clone(), bbox)?,
            policy: Policy::new(params.policy.clone()),
            state: TrackState::Tracking,
            classes: Classes::default(),
            last_believed: bbox,
            history: 1,
            looks: 1,
            unseen_s: 0.0,
            undetected_s: 0.0,
            given,
        };
        Ok(Self::of(belief, None))
    }

    /// From what was saved.
    pub fn of(belief: Belief, appearance: Option<Box<dyn Tracker>>) -> Self {
        Self { belief, appearance, prior: None, expectation: None, answer: None }
    }

    /// Where it is believed to be now.
    pub fn bbox(&self) -> BBox {
        self.belief.motion.bbox()
    }

    /// What a detector is told of it.
    pub fn followed(&self) -> Followed {
        Followed { bbox: self.bbox(), measured: self.belief.state == TrackState::Tracking }
    }

    /// Phase 1: where it should be in this frame.
    pub fn predict(&mut self, dt_s: f64, params: &AssociationParams) -> Result<(), EstimationError> {
        let prior = self.belief.motion.predict(dt_s)?;
        self.expectation = Some(Expectation::new(&prior, params));
        self.prior = Some(prior);
        Ok(())
    }

    /// Phase 2: what it costs to take a detection for this target; `None` outside the gate.
    pub fn cost(&self, detection: &Detection, params: &AssociationParams) -> Option<f64> {
        let other_class = self.belief.classes.is_other(detection.class.as_ref());
        self.expectation.as_ref()?.cost(&detection.bbox, other_class, params)
    }

    /// Counts what a detection was taken for.
    pub fn count_class(&mut self, detection: &Detection) {
        if let Some(class) = &detection.class {
            self.belief.classes.count(class, detection.confidence);
        }
    }

    /// Phase 3: takes its detection, or what appearance says where there is none.
    pub fn update(&mut self, frame: &Frame, detection: Option<&Detection>, params: &AssociationParams) -> Result<()> {
        let Some(prior) = self.prior.take() else { return Ok(()) };
        self.count(detection.is_some(), prior.dt_s);
        detection.into_iter().for_each(|d| self.count_class(d));
        let answer = self.appearance.as_mut().map(|a| a.update(frame)).transpose()?;
        let mut found = match detection {
            Some(d) => Some(Measurement::new(d.bbox, d.confidence)),
            None => answer.as_ref().and_then(|a| self.plausible(a, params)),
        };
        if let (Some(found), Some(expectation)) = (&mut found, &self.expectation) {
            let share = (expectation.distance2(&found.bbox) / params.gate).clamp(0.0, 1.0);
            found.gate_share = Some(share).filter(|_| self.belief.state != TrackState::Lost);
        }
        let estimate = self.judge(frame, &prior, found)?;
        if let (Some(detection), Some(appearance), Some(answer)) = (detection, &mut self.appearance, &answer)
            && answer.bbox.iou(&detection.bbox) < params.appearance_overlap
        {
            appearance.reinit(frame, detection.bbox)?;
        }
        self.answer = Some((estimate, Elapsed::default()));
        Ok(())
    }

    fn count(&mut self, detected: bool, dt_s: f64) {
        let belief = &mut self.belief;
        belief.history = belief.history << 1 | u64::from(detected);
        belief.looks += 1;
        belief.undetected_s = if detected { 0.0 } else { belief.undetected_s + dt_s };
        belief.unseen_s += dt_s;
    }

    /// What appearance says, where it may be believed: it sees the target, near its prediction, not for too long.
    fn plausible(&self, answer: &Estimate, params: &AssociationParams) -> Option<Measurement> {
        let trusted = self.belief.given || self.belief.undetected_s <= params.appearance_s;
        let gated = |e: &Expectation| e.cost(&answer.bbox, false, params).is_some();
        let near = self.belief.given || self.expectation.as_ref().is_some_and(gated);
        let believed = answer.state == TrackState::Tracking && trusted && near;
        believed.then(|| Measurement::new(answer.bbox, answer.score))
    }

    /// The policy's judgement, and what it does to the motion.
    fn judge(&mut self, frame: &Frame, prior: &Prior, found: Option<Measurement>) -> Result<Estimate> {
        let belief = &mut self.belief;
        let failed = |e: EstimationError| failed(frame.index(), e);
        let evidence = Evidence { frame: frame.size(), prior, found: found.as_ref(), state: belief.state };
        let verdict = belief.policy.judge(&evidence);
        let doubt = evidence.doubt(verdict.state, || None);
        if let Some(found) = found.as_ref().filter(|_| verdict.state == TrackState::Tracking) {
            if belief.state == TrackState::Lost {
                belief.motion.restart(found.bbox);
            } else {
                belief.motion.correct(&Sight::from(found)).map_err(failed)?;
            }
            belief.last_believed = belief.motion.bbox();
            belief.unseen_s = 0.0;
        }
        belief.state = verdict.state;
        let lost = verdict.state == TrackState::Lost;
        Ok(Estimate {
            time_s: frame.time_s(),
            bbox: if lost { belief.last_believed } else { belief.motion.bbox() },
            score: verdict.score.clamp(0.0, 1.0),
            state: verdict.state,
            doubt,
            prediction: Some(prior.bbox),
            measurement: found.map(|m| m.bbox),
            searched: None,
            covariance: belief.motion.covariance(),
            velocity: belief.motion.velocity().filter(|_| !lost),
            next: belief.motion.next_sample(),
            diagnostics: Diagnostics::default(),
        })
    }

    /// Phase 4: whether a candidate was detected often enough.
    pub fn is_confirmed(&self, params: &AssociationParams) -> bool {
        self.hits(params) >= params.confirm_hits
    }

    /// Phase 4: whether it is to be given up.
    pub fn is_dead(&self, frame: &Frame, params: &AssociationParams) -> bool {
        let belief = &self.belief;
        if belief.given {
            return false;
        }
        if belief.id.is_none() {
            let looks = usize::try_from(belief.looks).unwrap_or(usize::MAX).min(params.confirm_looks);
            return looks - self.hits(params).min(looks) > params.confirm_looks - params.confirm_hits;
        }
        // A target that is lost where no picture is has left.
        let left = belief.state == TrackState::Lost && self.bbox().clipped_to(frame.size()).is_none();
        left || belief.unseen_s > params.dies_after_s
    }

    /// How often it was detected in the last N frames.
    fn hits(&self, params: &AssociationParams) -> usize {
        let unused = u64::BITS.saturating_sub(params.confirm_looks as u32);
        (self.belief.history << unused).count_ones() as usize
    }

    /// A user says where it is.
    pub fn put(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        if let Some(appearance) = &mut self.appearance {
            appearance.reinit(frame, bbox)?;
        }
        let belief = &mut self.belief;
        belief.motion.restart(bbox);
        belief.policy.restart();
        belief.state = TrackState::Tracking;
        belief.last_believed = bbox;
        belief.classes = Classes::default();
        (belief.unseen_s, belief.undetected_s) = (0.0, 0.0);
        Ok(())
    }

    /// Goes on with other parameters.
    pub fn change(&mut self, params: &AssociationParams) -> Result<(), EstimationError> {
        if *self.belief.motion.params() != params.motion {
            self.belief.motion.change(params.motion.clone())?;
        }
        self.belief.policy.change(params.policy.clone());
        Ok(())
    }
}

/// Says of an error of the motion model where it happened.
pub(super) fn failed(index: u64, source: EstimationError) -> TrackingError {
    TrackingError::Computation { tracker: super::associating::NAME.to_owned(), index, source: Box::new(source) }
}
