//! Where to look for the ball and when to believe that it was seen.

use super::params::BallParams;
use crate::{Evidence, Policy, Prior, Proposer, Search, TrackState, Verdict};
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use serde::{Deserialize, Serialize};

/// Of the ball's size: looked at on every side beyond the gate.
const MARGIN: f64 = 1.0;

/// Confidence asked of what shows up at the gate's edge after the ball was missed: like-coloured things pass by.
const FAR_AND_UNSEEN: f64 = 0.85;
/// The gate's covariance is shrunk to this fraction while the ball is coasted.
const UNSEEN: f64 = 0.5;
/// What a frame counts in which the ball is predicted outside of the picture.
const OUTSIDE: u32 = 4;

/// Looks where the gate reaches while the ball is tracked or coasted, everywhere once it is lost.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BallProposer {
    gate_sigmas: f64,
    gate_slack: f64,
}

impl BallProposer {
    pub(super) fn new(params: &BallParams) -> Self {
        Self { gate_sigmas: params.gate_chi2.sqrt(), gate_slack: params.gate_slack }
    }
}

impl Proposer for BallProposer {
    fn propose(&mut self, frame: &Frame, prior: &Prior, state: TrackState) -> Search {
        let expected = prior.bbox;
        let Some(gate) = prior.innovation_covariance.filter(|_| state != TrackState::Lost) else {
            return Search { expected, region: frame.size().bounds(), gate: None, wide: true };
        };
        // A hidden ball may bounce behind what hides it, but far more often what shows up far away is something else.
        let gate = if state == TrackState::Occluded { gate * UNSEEN } else { gate };
        let extent = expected.area().sqrt();
        let reach = |variance: f64| {
            let slack = self.gate_slack * extent;
            self.gate_sigmas * (variance.max(0.0) + slack * slack).sqrt() + MARGIN * extent
        };
        let (dx, dy) = (reach(gate[(0, 0)]), reach(gate[(1, 1)]));
        let region =
            BBox::from_center_size(expected.center(), expected.width() + 2.0 * dx, expected.height() + 2.0 * dy);
        Search { expected, region, gate: Some(gate), wide: false }
    }
}

/// Believes what is confident enough: less is asked near a prediction made from the frame before, more once the ball has
/// been missed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BallPolicy {
    min_confidence: f64,
    min_confidence_unseen: f64,
    misses_before_lost: u32,
    gate_chi2: f64,
    misses: u32,
}

impl BallPolicy {
    pub(super) fn new(params: &BallParams) -> Self {
        Self {
            min_confidence: params.min_confidence,
            min_confidence_unseen: params.min_confidence_unseen,
            misses_before_lost: params.misses_before_lost,
            gate_chi2: params.gate_chi2,
            misses: 0,
        }
    }
}

impl Policy for BallPolicy {
    fn judge(&mut self, evidence: &Evidence<'_>) -> Verdict {
        // The nearer to the prediction, the less need the looks prove; what lies at the gate must look right.
        let distance = evidence.found.and_then(|f| f.diagnostics.get("gate_distance"));
        let away = distance.map_or(1.0, |d| (d / self.gate_chi2).clamp(0.0, 1.0)).sqrt();
        let (near, far) = if self.misses == 0 {
            (self.min_confidence, self.min_confidence_unseen)
        } else {
            (self.min_confidence_unseen, f64::midpoint(self.min_confidence_unseen, 1.0).max(FAR_AND_UNSEEN))
        };
        // Once lost there is no prediction to be near to; the localizer's own conditions are strict then.
        let needed = if evidence.search.gate.is_none() {
            self.min_confidence_unseen
        } else {
            near + away * (far - near).max(0.0)
        };
        if let Some(found) = evidence.found.filter(|f| f.confidence >= needed) {
            self.misses = 0;
            // A colour region inside the gate is the ball nearly always; what is left is whether its box fits.
            let score = 0.5 + 0.5 * found.confidence;
            return Verdict {
                state: TrackState::Tracking,
                score,
                learn: found.confidence >= self.min_confidence_unseen,
            };
        }
        // Where the frame does not reach, waiting is of no use.
        let outside = evidence.prior.bbox.clipped_to(evidence.frame.size()).is_none();
        self.misses = self.misses.saturating_add(if outside { OUTSIDE } else { 1 });
        let lost = evidence.state == TrackState::Lost || self.misses > self.misses_before_lost;
        // Coasting loses its worth as the uncertainty outgrows the box.
        let spread = evidence.prior.innovation_covariance.map_or(1.0, |s| {
            let half = evidence.prior.bbox.area().sqrt() / 2.0;
            ((s[(0, 0)] + s[(1, 1)]) / 2.0).max(0.0).sqrt() / half.max(1.0)
        });
        let score = if lost { 0.02 } else { 0.4 / (1.0 + spread) };
        let state = if lost { TrackState::Lost } else { TrackState::Occluded };
        Verdict { state, score, learn: false }
    }

    fn restart(&mut self) {
        self.misses = 0;
    }
}
