use super::integrator::Joined;
use pursuit_tracking::TrackState;
use serde::{Deserialize, Serialize};

/// Whether the trajectory is trusted, and for how long the target was not seen.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Raw", into = "Raw")]
pub(super) struct Trust {
    /// Whether the trajectory is trusted enough to be learned from (kalal2012, section 5.6).
    pub valid: bool,
    /// Seconds since the target was last reported as seen.
    pub unseen_s: f64,
}

/// What is stored: `valid`, `unseen_s`.
#[derive(Clone, Serialize, Deserialize)]
struct Raw(bool, f64);

impl From<Trust> for Raw {
    fn from(it: Trust) -> Self {
        Self(it.valid, it.unseen_s)
    }
}

impl TryFrom<Raw> for Trust {
    type Error = &'static str;

    fn try_from(Raw(valid, unseen_s): Raw) -> Result<Self, Self::Error> {
        if unseen_s >= 0.0 { Ok(Self { valid, unseen_s }) } else { Err("the time its target was not seen is negative") }
    }
}

impl Trust {
    /// In the frame that the target is shown in.
    pub const fn new() -> Self {
        Self { valid: true, unseen_s: 0.0 }
    }

    /// Takes what became of a frame that came `dt_s` after the one before: the trajectory goes on from `joined`, if from
    /// anything.
    pub fn take(&mut self, joined: Option<&Joined>, state: TrackState, dt_s: f64) {
        self.valid = joined.is_some_and(|j| j.valid);
        self.unseen_s = if state == TrackState::Tracking { 0.0 } else { self.unseen_s + dt_s };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::appearance::Similarity;
    use pursuit_geometry::BBox;

    fn joined(valid: bool) -> Joined {
        let similarity = Similarity { positive: 0.9, early: 0.9, negative: 0.5 };
        let window = BBox::from_ltwh(1.0, 2.0, 30.0, 20.0);
        Joined { window, similarity, valid, followed: None, agreed: false }
    }

    #[test]
    fn trust_ends_with_the_trajectory_and_time_unseen_is_counted() {
        let mut trust = Trust::new();
        assert_eq!(trust, Trust { valid: true, unseen_s: 0.0 });
        trust.take(Some(&joined(true)), TrackState::Occluded, 0.5);
        trust.take(Some(&joined(false)), TrackState::Occluded, 0.25);
        assert_eq!(trust, Trust { valid: false, unseen_s: 0.75 });
        trust.take(Some(&joined(true)), TrackState::Tracking, 0.25);
        assert_eq!(trust, Trust { valid: true, unseen_s: 0.0 });
        trust.take(None, TrackState::Lost, 2.0);
        assert_eq!(trust, Trust { valid: false, unseen_s: 2.0 });
    }

    #[test]
    fn saved_trust_is_the_same_and_negative_time_is_refused() {
        let trust = Trust { valid: true, unseen_s: 1.5 };
        let saved = serde_json::to_string(&trust).unwrap();
        assert_eq!(serde_json::from_str::<Trust>(&saved).unwrap(), trust);
        assert!(serde_json::from_str::<Trust>("[true,-0.5]").is_err());
    }
}
