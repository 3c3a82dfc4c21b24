//! Policies: when a target counts as seen, unsure, occluded, lost; what is followed; what is learned.
//!
//! Three decisions stand apart: what to say (`state`, `score`), whether an unsure measurement moves the box (`follow`), and
//! whether appearance learns (`learn`).

mod params;

pub use params::{CalibratedParams, GatedParams, PaperParams, PolicyModel, PolicyParams};

use crate::{Doubt, Measurement, Prior, TrackState};
use pursuit_geometry::Size;
use serde::{Deserialize, Serialize};

/// Everything a policy may judge by.
#[derive(Debug)]
pub struct Evidence<'a> {
    /// Size of the frame.
    pub frame: Size,
    /// What the motion model expected.
    pub prior: &'a Prior,
    /// What was found.
    pub found: Option<&'a Measurement>,
    /// The state before this frame.
    pub state: TrackState,
}

impl Evidence<'_> {
    /// Why a target is not tracked of which the state `concluded` was concluded; `hidden` is asked why one is not seen that
    /// should be in the picture.
    pub fn doubt(&self, concluded: TrackState, hidden: impl FnOnce() -> Option<Doubt>) -> Option<Doubt> {
        let outside = || self.prior.bbox.clipped_to(self.frame).is_none();
        match concluded {
            TrackState::Tracking => None,
            TrackState::Unsure | TrackState::Occluded if !outside() => hidden(),
            TrackState::Unsure | TrackState::Occluded | TrackState::Lost => Some(Doubt::Gone),
        }
    }
}

/// A policy's judgement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Verdict {
    /// The state of this frame. `Tracking` means that the measurement is believed, `Unsure` that one is followed that is not.
    pub state: TrackState,
    /// The probability, in `[0, 1]`, that the box reported overlaps the target by one half.
    pub score: f64,
    /// Whether a measurement that is not believed moves the box all the same, as the best guess of where the target is.
    pub follow: bool,
    /// Whether appearance may learn from this frame; ignored unless `state` is `Tracking` or the measurement is followed.
    pub learn: bool,
}

/// Judges whether the target is still seen, by the rule that its parameters name.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Policy {
    params: PolicyParams,
    /// Time that the target has not been seen, in seconds.
    unseen_s: f64,
    /// Time since the target was sure, in seconds.
    doubt_s: f64,
    /// What is left of the probation, in seconds.
    probation_s: f64,
}

impl Policy {
    /// A policy at its start.
    pub const fn new(params: PolicyParams) -> Self {
        Self { params, unseen_s: 0.0, doubt_s: 0.0, probation_s: 0.0 }
    }

    /// Its parameters.
    pub const fn params(&self) -> &PolicyParams {
        &self.params
    }

    /// Goes on with other parameters.
    pub fn change(&mut self, params: PolicyParams) {
        self.params = params;
    }

    /// Forgets everything: a new target.
    pub fn restart(&mut self) {
        (self.unseen_s, self.doubt_s, self.probation_s) = (0.0, 0.0, 0.0);
    }

    /// Whether the target was not sure for so long that it is to be looked for elsewhere too.
    pub fn looks_elsewhere(&self) -> bool {
        match self.params.model {
            PolicyModel::Calibrated => self.doubt_s > self.params.calibrated.elsewhere_after_s,
            PolicyModel::Gated | PolicyModel::Paper | PolicyModel::Always => false,
        }
    }

    /// Whether the target was found again so lately that a doubt loses it at once.
    pub fn is_on_probation(&self) -> bool {
        self.probation_s > 0.0
    }

    /// Whether a target whose measurement is not followed is looked for where it is expected, and not where that was.
    pub fn coasts(&self) -> bool {
        match self.params.model {
            PolicyModel::Calibrated => self.params.calibrated.follow_from > 0.0,
            PolicyModel::Gated | PolicyModel::Paper | PolicyModel::Always => false,
        }
    }

    /// From this probability on a measurement leaves no doubt, so that nobody need look elsewhere.
    pub const fn sure_from(&self) -> f64 {
        match self.params.model {
            PolicyModel::Calibrated | PolicyModel::Gated => self.params.seen_from,
            PolicyModel::Paper | PolicyModel::Always => 0.0,
        }
    }

    /// The judgement of this frame.
    pub fn judge(&mut self, evidence: &Evidence<'_>) -> Verdict {
        let confidence = evidence.found.map_or(0.0, |m| m.confidence);
        if evidence.found.is_some_and(|found| self.believes(found, evidence.state)) {
            (self.unseen_s, self.doubt_s) = (0.0, 0.0);
            let found = evidence.state == TrackState::Lost;
            self.probation_s =
                if found { self.params.probation_s } else { (self.probation_s - evidence.prior.dt_s).max(0.0) };
            let learn = match self.params.model {
                PolicyModel::Calibrated | PolicyModel::Gated => {
                    confidence >= self.params.learn_from && self.probation_s == 0.0
                }
                PolicyModel::Paper => self.probation_s == 0.0,
                PolicyModel::Always => true,
            };
            return Verdict { state: TrackState::Tracking, score: confidence, follow: true, learn };
        }
        self.wait(evidence, confidence);
        let fails = self.probation_s > 0.0;
        self.probation_s = 0.0;
        let p = &self.params;
        let lost = match p.model {
            PolicyModel::Always => false,
            PolicyModel::Calibrated | PolicyModel::Gated | PolicyModel::Paper => {
                evidence.state == TrackState::Lost || self.unseen_s > p.lost_after_s || fails
            }
        };
        if lost {
            // A lost target's box is where it was long ago: a weak response elsewhere says nothing for it.
            return Verdict { state: TrackState::Lost, score: 0.0, follow: false, learn: false };
        }
        let (score, follow, learn) = match p.model {
            PolicyModel::Calibrated => {
                let follow = confidence >= p.calibrated.follow_from;
                (confidence.min(p.occluded_score), follow, confidence >= p.calibrated.learn_unsure_from)
            }
            PolicyModel::Gated => (p.occluded_score / (1.0 + spread(evidence.prior)), false, false),
            PolicyModel::Paper | PolicyModel::Always => (confidence.min(p.occluded_score), false, false),
        };
        let state = if follow && evidence.found.is_some() { TrackState::Unsure } else { TrackState::Occluded };
        Verdict { state, score, follow, learn }
    }

    /// Whether what was found is the target.
    fn believes(&self, found: &Measurement, state: TrackState) -> bool {
        let p = &self.params;
        match p.model {
            PolicyModel::Always => true,
            PolicyModel::Paper => found.psr.is_none_or(|psr| psr >= p.paper.psr_from),
            PolicyModel::Calibrated => {
                found.confidence
                    >= match state {
                        TrackState::Tracking => p.occluded_below,
                        TrackState::Unsure | TrackState::Occluded => p.seen_from,
                        TrackState::Lost => p.found_from,
                    }
            }
            PolicyModel::Gated => {
                // Once lost there is no prediction to be near to.
                let Some(share) = found.gate_share else { return found.confidence >= p.found_from };
                let (near, far) = if self.unseen_s == 0.0 {
                    (p.occluded_below, p.seen_from)
                } else {
                    (p.seen_from, p.gated.far_from)
                };
                found.confidence >= near + share.clamp(0.0, 1.0).sqrt() * (far - near).max(0.0)
            }
        }
    }

    /// Counts the time of a frame in which the target was not seen.
    fn wait(&mut self, evidence: &Evidence<'_>, confidence: f64) {
        let dt_s = evidence.prior.dt_s;
        self.doubt_s += dt_s;
        let outside = evidence.prior.bbox.clipped_to(evidence.frame).is_none();
        self.unseen_s += match self.params.model {
            PolicyModel::Gated if outside => dt_s * self.params.gated.outside_haste,
            PolicyModel::Calibrated if confidence >= self.params.calibrated.lost_below => 0.0,
            PolicyModel::Calibrated | PolicyModel::Gated | PolicyModel::Paper | PolicyModel::Always => dt_s,
        };
    }
}

/// How far the expectation may be off, in half sides of the box: coasting loses its worth as that grows.
fn spread(prior: &Prior) -> f64 {
    prior.innovation_covariance.map_or(1.0, |s| {
        let half = prior.bbox.area().sqrt() / 2.0;
        ((s[(0, 0)] + s[(1, 1)]) / 2.0).max(0.0).sqrt() / half.max(1.0)
    })
}

#[cfg(test)]
mod tests;
