use crate::{Prior, Proposer, Search, TrackState};
use pursuit_imaging::Frame;
use serde::{Deserialize, Serialize};

/// Looks near the prediction, and all over the frame once the target is lost.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct NearThenWide {
    /// The region near the prediction is this many times as large as the target.
    pub reach: f64,
}

impl Proposer for NearThenWide {
    fn propose(&mut self, frame: &Frame, prior: &Prior, state: TrackState) -> Search {
        let wide = state == TrackState::Lost;
        Search {
            expected: prior.bbox,
            region: if wide { frame.size().bounds() } else { prior.bbox.scaled(self.reach) },
            gate: if wide { None } else { prior.innovation_covariance },
            wide,
        }
    }
}
