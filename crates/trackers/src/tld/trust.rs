use super::integrator::Joined;
use super::params::NeighborParams;
use pursuit_tracking::TrackState;
use serde::{Deserialize, Serialize};

/// Whether the trajectory is trusted, how well the target was matched, and for how long it was not seen.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(remote = "Trust")]
pub(super) struct Trust {
    /// Whether the trajectory is trusted enough to be learned from (kalal2012, section 5.6).
    pub valid: bool,
    /// Conservative similarity of what was seen lately, put right and averaged.
    pub level: f64,
    /// Seconds since `level` took anything in.
    pub level_s: f64,
    /// Seconds since the target was last reported as seen.
    pub unseen_s: f64,
}

pursuit_estimation::checked!(Trust);

impl Trust {
    fn restored(self) -> Result<Self, &'static str> {
        let whole = self.level_s >= 0.0 && self.unseen_s >= 0.0 && (0.0..=1.0).contains(&self.level);
        if whole { Ok(self) } else { Err("its trust is out of range") }
    }
}

impl Trust {
    /// In the frame that the target is shown in.
    pub const fn new() -> Self {
        Self { valid: true, level: 0.5, level_s: 0.0, unseen_s: 0.0 }
    }

    /// Takes what became of a frame that came `dt_s` after the one before: the trajectory goes on from `joined`, if from
    /// anything.
    pub fn take(&mut self, joined: Option<&Joined>, state: TrackState, dt_s: f64, params: &NeighborParams) {
        self.valid = joined.is_some_and(|j| j.valid);
        self.level_s += dt_s;
        if state != TrackState::Tracking {
            self.unseen_s += dt_s;
            return;
        }
        self.unseen_s = 0.0;
        if let Some(aligned) = joined.and_then(|j| j.aligned) {
            self.level += (self.level_s / params.memory_s).min(1.0) * (aligned - self.level);
            self.level_s = 0.0;
        }
    }

    /// Whether what has the conservative similarity `sure` may be what was seen lately: of a target that was matched closely
    /// a poor match is another.
    pub fn is_as_before(&self, sure: f64, params: &NeighborParams) -> bool {
        let log_odds = |share: f64| (share / (1.0 - share).max(1e-6)).max(1e-6).ln();
        log_odds(sure) >= log_odds(self.level) - params.as_before
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::appearance::Similarity;
    use pursuit_geometry::BBox;

    fn joined(valid: bool, aligned: Option<f64>) -> Joined {
        let similarity = Similarity { positive: 0.9, early: 0.9, negative: 0.5 };
        let window = BBox::from_ltwh(1.0, 2.0, 30.0, 20.0);
        Joined { window, similarity, aligned, valid, followed: None, agreed: false }
    }

    #[test]
    fn trust_ends_with_the_trajectory() {
        let params = NeighborParams { memory_s: 1.0, ..NeighborParams::default() };
        let mut trust = Trust::new();
        let at = |valid, level, level_s, unseen_s| Trust { valid, level, level_s, unseen_s };
        assert_eq!(trust, at(true, 0.5, 0.0, 0.0));
        trust.take(Some(&joined(true, Some(0.9))), TrackState::Occluded, 0.5, &params);
        trust.take(Some(&joined(false, Some(0.9))), TrackState::Occluded, 0.25, &params);
        assert_eq!(trust, at(false, 0.5, 0.75, 0.75));
        trust.take(Some(&joined(true, None)), TrackState::Tracking, 0.125, &params);
        assert_eq!(trust, at(true, 0.5, 0.875, 0.0));
        // What was unlike for seven eighths of the memory and an eighth more is forgotten whole.
        trust.take(Some(&joined(true, Some(0.75))), TrackState::Tracking, 0.125, &params);
        assert_eq!(trust, at(true, 0.75, 0.0, 0.0));
        trust.take(Some(&joined(true, Some(0.25))), TrackState::Tracking, 0.25, &params);
        assert_eq!(trust, at(true, 0.625, 0.0, 0.0));
        trust.take(Some(&joined(true, Some(1.0))), TrackState::Tracking, 7.0, &params);
        assert_eq!(trust.level, 1.0, "no more than all of what is seen");
        trust.take(None, TrackState::Lost, 2.0, &params);
        assert!(!trust.valid && trust.unseen_s == 2.0);
    }

    #[test]
    fn after_a_close_match_a_poor_is_another() {
        let params = NeighborParams { as_before: 3f64.ln(), ..NeighborParams::default() };
        let trust = Trust { valid: true, level: 0.9, level_s: 0.0, unseen_s: 0.0 };
        // Odds of nine, a third of them, and a little less.
        assert!(
            trust.is_as_before(0.9, &params) && trust.is_as_before(0.7501, &params) && trust.is_as_before(1.0, &params)
        );
        assert!(!trust.is_as_before(0.7499, &params) && !trust.is_as_before(0.0, &params));
        assert!(!Trust { level: 1.0, ..trust }.is_as_before(0.99, &params));
    }

    #[test]
    fn saved_trust_returns_and_senseless_is_refused() {
        let trust = Trust { valid: true, level: 0.8, level_s: 0.25, unseen_s: 1.5 };
        let saved = serde_json::to_string(&trust).unwrap();
        assert_eq!(serde_json::from_str::<Trust>(&saved).unwrap(), trust);
        for bad in ["[true,0.8,0.0,-0.5]", "[true,0.8,-0.5,0.0]", "[true,1.5,0.0,0.0]"] {
            assert!(serde_json::from_str::<Trust>(bad).is_err(), "{bad}");
        }
    }
}
