//! Places where a target that is out of sight may be, each believed by the evidence of several looks.

use super::{Observation, SearchParams};
use pursuit_estimation::logit;
use pursuit_geometry::BBox;
use serde::{Deserialize, Serialize};

/// Most places at once.
pub(super) const MOST: usize = 3;

/// A place and what speaks for it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Tentative {
    pub bbox: BBox,
    /// Sum over its looks of what each says, a sequential probability ratio test (wald1945).
    pub odds: f64,
}

impl Tentative {
    /// A place that was seen for the first time.
    pub fn new<F>(params: &SearchParams, seen: &Observation<F>) -> Self {
        Self { bbox: seen.measurement.bbox, odds: said(params, seen) }
    }

    /// Takes another look into account; false: nothing speaks for it any more.
    pub fn look<F>(&mut self, params: &SearchParams, seen: Option<&Observation<F>>) -> bool {
        let Some(seen) = seen else { return false };
        self.odds += params.news * said(params, seen);
        self.bbox = seen.measurement.bbox;
        self.odds > -params.believe_at / 2.0
    }
}

fn said<F>(params: &SearchParams, seen: &Observation<F>) -> f64 {
    logit(seen.measurement.confidence.clamp(1e-4, 1.0 - 1e-4)) - params.neutral
}
