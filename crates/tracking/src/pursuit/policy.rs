use crate::{Evidence, Policy, TrackState, Verdict};
use serde::{Deserialize, Serialize};

/// Thresholds of an [`HonestPolicy`]: probabilities in `[0, 1]`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct HonestThresholds {
    /// Below this a target that is tracked counts as occluded.
    pub occluded_below: f64,
    /// From this on an occluded target counts as seen again.
    pub seen_from: f64,
    /// From this on a lost target counts as found.
    pub found_from: f64,
    /// Appearance is learned from this on.
    pub learn_from: f64,
    /// Time counts towards losing an occluded target while the score is below this.
    pub lost_below: f64,
    /// A target occluded for longer than this many seconds is lost.
    pub lost_after_s: f64,
}

/// Keeps where the target is believed to be apart from whether it is seen: an unsure measurement still moves the box while
/// the target may be there, but the state says `Occluded` and nothing is learned.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HonestPolicy {
    thresholds: HonestThresholds,
    unseen_s: f64,
}

impl HonestPolicy {
    /// With these thresholds.
    pub const fn new(thresholds: HonestThresholds) -> Self {
        Self { thresholds, unseen_s: 0.0 }
    }
}

impl Policy for HonestPolicy {
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
        if confidence < t.lost_below || evidence.found.is_none() {
            self.unseen_s += evidence.prior.dt_s;
        }
        let lost = evidence.state == TrackState::Lost || self.unseen_s > t.lost_after_s;
        let state = if lost { TrackState::Lost } else { TrackState::Occluded };
        // What was found elsewhere says nothing for the box of a lost target, which is where it was long ago.
        let score = if evidence.search.wide { confidence.min(UNSEEN_SCORE) } else { confidence };
        Verdict { state, score, learn: false }
    }

    fn follows(&self, state: TrackState) -> bool {
        state == TrackState::Occluded
    }

    fn restart(&mut self) {
        self.unseen_s = 0.0;
    }
}

/// How often the last box of a lost target is right after all.
const UNSEEN_SCORE: f64 = 0.1;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Diagnostics, Measurement, Prior, Search};
    use pursuit_geometry::BBox;
    use pursuit_imaging::{Frame, Image, Pixels};

    fn judge(policy: &mut HonestPolicy, state: TrackState, confidence: f64) -> Verdict {
        let frame = Frame::new(0, 0.0, Pixels::Gray8(Image::filled(4, 4, 7).unwrap()));
        let bbox = BBox::from_ltwh(0.0, 0.0, 4.0, 4.0);
        let prior = Prior { bbox, innovation_covariance: None, dt_s: 0.1 };
        let search = Search { expected: bbox, region: bbox, gate: None, wide: state == TrackState::Lost };
        let found = Measurement { bbox, confidence, sigma_px: None, diagnostics: Diagnostics::default() };
        policy.judge(&Evidence { frame: &frame, prior: &prior, search: &search, found: Some(&found), state })
    }

    #[test]
    fn seen_occluded_lost_and_found() {
        let thresholds = HonestThresholds {
            occluded_below: 0.2,
            seen_from: 0.3,
            found_from: 0.6,
            learn_from: 0.25,
            lost_below: 0.3,
            lost_after_s: 0.15,
        };
        let mut policy = HonestPolicy::new(thresholds);
        let seen = judge(&mut policy, TrackState::Tracking, 0.22);
        assert_eq!((seen.state, seen.learn), (TrackState::Tracking, false));
        assert!(judge(&mut policy, TrackState::Tracking, 0.9).learn);
        assert_eq!(judge(&mut policy, TrackState::Tracking, 0.1).state, TrackState::Occluded);
        assert_eq!(judge(&mut policy, TrackState::Occluded, 0.29).state, TrackState::Lost);
        let lost = judge(&mut policy, TrackState::Lost, 0.5);
        assert!(lost.state == TrackState::Lost && lost.score <= 0.1 && !lost.learn);
        assert_eq!(judge(&mut policy, TrackState::Lost, 0.7).state, TrackState::Tracking);
        assert_eq!(judge(&mut policy, TrackState::Tracking, 0.1).state, TrackState::Occluded);
        assert!(policy.follows(TrackState::Occluded) && !policy.follows(TrackState::Lost));
    }
}
