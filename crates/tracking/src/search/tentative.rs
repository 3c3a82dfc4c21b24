//! Places where a target that is out of sight may be, each believed by the evidence of several looks.

use super::{Observation, SearchParams};
use pursuit_estimation::{logit, sigmoid};
use pursuit_geometry::BBox;
use serde::{Deserialize, Serialize};

/// Most places at once.
pub(super) const MOST: usize = 3;
/// Boxes that overlap by this much are of one place.
const SAME_FROM: f64 = 0.3;
/// A place is dropped at minus this share of what makes it believed.
const DROPPED_AT: f64 = 0.5;
/// No look says more than the log odds of this probability.
const SUREST: f64 = 1.0 - 1e-4;

/// A place and what speaks for it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Tentative {
    pub bbox: BBox,
    /// Sum over its looks of what each says, a sequential probability ratio test (wald1945).
    odds: f64,
}

impl Tentative {
    fn is_same(&self, bbox: &BBox) -> bool {
        self.bbox.iou(bbox) >= SAME_FROM
    }
}

/// All places, and what the looks of a frame make of them.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Tentatives(Vec<Tentative>);

impl Default for Tentatives {
    fn default() -> Self {
        Self(Vec::with_capacity(MOST))
    }
}

impl Tentatives {
    /// The place of that number, if there is one.
    pub fn get(&self, place: usize) -> Option<&Tentative> {
        self.0.get(place).filter(|_| place < MOST)
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// Takes the looks of a frame into account, `again` at the places known and `swept` elsewhere. The best place, with the
    /// probability that all its looks give it where it is believed by now, and else with one too small to be a find.
    pub fn weigh<F>(
        &mut self,
        params: &SearchParams,
        sure_from: f64,
        swept: Option<Observation<F>>,
        again: [Option<Observation<F>>; MOST],
    ) -> Option<Observation<F>> {
        let known: [Option<f64>; MOST] = std::array::from_fn(|place| Some(self.0.get(place)?.odds));
        self.0.clear();
        let mut best: Option<(f64, Observation<F>)> = None;
        // Of two places that have become one the first is kept.
        for (before, seen) in known.into_iter().zip(again).chain([(None, swept)]) {
            let Some(seen) = seen else { continue };
            let odds = match before {
                Some(odds) => odds + params.news * said(params, &seen),
                None => said(params, &seen),
            };
            let bbox = seen.measurement.bbox;
            let room = self.0.len() < params.tentative.min(MOST) && !self.0.iter().any(|place| place.is_same(&bbox));
            if !room || odds <= -DROPPED_AT * params.believe_at {
                continue;
            }
            self.0.push(Tentative { bbox, odds });
            if best.as_ref().is_none_or(|(most, _)| odds > *most) {
                best = Some((odds, seen));
            }
        }
        let (odds, mut found) = best?;
        let last = found.measurement.confidence;
        found.measurement.confidence =
            if odds >= params.believe_at { last.max(sigmoid(odds)) } else { last.min(sure_from / 2.0) };
        Some(found)
    }
}

/// What one look says for its place.
fn said<F>(params: &SearchParams, seen: &Observation<F>) -> f64 {
    logit(seen.measurement.confidence.clamp(1.0 - SUREST, SUREST)) - params.neutral
}
