//! Policies that several trackers share: when a target counts as seen, occluded, lost.

use crate::{Evidence, Policy, TrackState, Verdict};
use serde::{Deserialize, Serialize};

/// Thresholds of [`ConfidencePolicy`], probabilities in `[0, 1]`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ConfidenceThresholds {
    /// Below this the target counts as occluded.
    pub occluded_below: f64,
    /// An occluded target counts as seen again from here.
    pub seen_from: f64,
    /// A lost target counts as found again from here.
    pub found_from: f64,
    /// Appearance is learned from here.
    pub learn_from: f64,
    /// Time counts towards losing an occluded target while the confidence is below this; 1: always.
    pub lost_below: f64,
    /// Occluded for longer than this many seconds, the target is lost.
    pub lost_after_s: f64,
    /// Most that the score of an occluded target may be.
    pub occluded_score: f64,
}

impl ConfidenceThresholds {
    /// For confidences that tell well whether a target that is seen is still seen, but less well whether one is seen again.
    ///
    /// The score: looks good enough to stay seen, but not to be seen again, are right less often than they would be of a
    /// target that is seen: in 14 to 47 % of such frames of real sequences, depending on the tracker, where the confidence
    /// was 41 % on average.
    pub const CAUTIOUS: Self = Self {
        occluded_below: 0.4,
        seen_from: 0.5,
        found_from: 0.5,
        learn_from: 0.4,
        lost_below: 1.0,
        lost_after_s: 1.0,
        occluded_score: 0.35,
    };
}

/// Judges by the localizer's confidence, with hysteresis: easier to stay seen than to be seen again.
///
/// Where the target is believed to be stands apart from whether it is seen: an unsure measurement still moves the box while
/// the target may be there, but the state says `Occluded` and nothing is learned.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ConfidencePolicy {
    thresholds: ConfidenceThresholds,
    unseen_s: f64,
}

impl ConfidencePolicy {
    /// With these thresholds.
    pub const fn new(thresholds: ConfidenceThresholds) -> Self {
        Self { thresholds, unseen_s: 0.0 }
    }
}

impl Policy for ConfidencePolicy {
    fn judge(&mut self, evidence: &Evidence<'_>) -> Verdict {
        let t = &self.thresholds;
        let confidence = evidence.found.map_or(0.0, |m| m.confidence);
        let needed = match evidence.state {
            TrackState::Tracking => t.occluded_below,
            TrackState::Occluded => t.seen_from,
            TrackState::Lost => t.found_from,
        };
        if confidence >= needed {
            self.unseen_s = 0.0;
            return Verdict { state: TrackState::Tracking, score: confidence, learn: confidence >= t.learn_from };
        }
        if confidence < t.lost_below {
            self.unseen_s += evidence.prior.dt_s;
        }
        let lost = evidence.state == TrackState::Lost || self.unseen_s > t.lost_after_s;
        let state = if lost { TrackState::Lost } else { TrackState::Occluded };
        // A lost target's box is where it was long ago: a weak response elsewhere says nothing for it.
        Verdict { state, score: if lost { 0.0 } else { confidence.min(t.occluded_score) }, learn: false }
    }

    fn follows(&self, state: TrackState) -> bool {
        state == TrackState::Occluded
    }

    fn restart(&mut self) {
        self.unseen_s = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Diagnostics, Measurement, Prior, Search};
    use pursuit_geometry::BBox;
    use pursuit_imaging::{Frame, Image};

    fn judge(policy: &mut ConfidencePolicy, state: TrackState, confidence: f64) -> Verdict {
        let frame = Frame::new(0, 0.0, Image::filled(4, 4, 7u8).unwrap());
        let bbox = BBox::from_ltwh(0.0, 0.0, 4.0, 4.0);
        let prior = Prior { bbox, innovation_covariance: None, dt_s: 0.1 };
        let search = Search { expected: bbox, region: bbox, gate: None, wide: state == TrackState::Lost };
        let found = Measurement { bbox, confidence, sigma_px: None, diagnostics: Diagnostics::default() };
        policy.judge(&Evidence { frame: &frame, prior: &prior, search: &search, found: Some(&found), state })
    }

    #[test]
    fn seen_occluded_lost_and_found() {
        let thresholds = ConfidenceThresholds {
            occluded_below: 0.2,
            seen_from: 0.3,
            found_from: 0.6,
            learn_from: 0.25,
            lost_below: 0.3,
            lost_after_s: 0.15,
            occluded_score: 0.15,
        };
        let mut policy = ConfidencePolicy::new(thresholds);
        let seen = judge(&mut policy, TrackState::Tracking, 0.22);
        assert_eq!((seen.state, seen.learn), (TrackState::Tracking, false));
        assert!(judge(&mut policy, TrackState::Tracking, 0.9).learn);
        assert_eq!(judge(&mut policy, TrackState::Tracking, 0.1).state, TrackState::Occluded);
        assert_eq!(judge(&mut policy, TrackState::Occluded, 0.29).state, TrackState::Lost);
        let lost = judge(&mut policy, TrackState::Lost, 0.5);
        assert!(lost.state == TrackState::Lost && lost.score == 0.0 && !lost.learn);
        assert_eq!(judge(&mut policy, TrackState::Lost, 0.7).state, TrackState::Tracking);
        assert_eq!(judge(&mut policy, TrackState::Tracking, 0.1).state, TrackState::Occluded);
        assert!(policy.follows(TrackState::Occluded) && !policy.follows(TrackState::Lost));
    }

    #[test]
    fn a_target_that_may_be_there_is_not_given_up() {
        let thresholds = ConfidenceThresholds { lost_below: 0.1, lost_after_s: 0.15, ..ConfidenceThresholds::CAUTIOUS };
        let mut policy = ConfidencePolicy::new(thresholds);
        let mut state = TrackState::Tracking;
        for _ in 0..10 {
            let verdict = judge(&mut policy, state, 0.39);
            assert_eq!((verdict.state, verdict.score, verdict.learn), (TrackState::Occluded, 0.35, false));
            state = verdict.state;
        }
        assert_eq!(judge(&mut policy, state, 0.05).state, TrackState::Occluded);
        assert_eq!(judge(&mut policy, state, 0.05).state, TrackState::Lost);
    }
}
