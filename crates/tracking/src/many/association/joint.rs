//! Joint probabilistic data association.

use super::{Given, Pairs};
use pursuit_estimation::EstimationError;
use pursuit_estimation::association::{Likelihood, SparseJoint};
use pursuit_estimation::consistency::chi_square_cumulative;

pursuit_parameters::parameters! {
    /// Joint probabilistic data association: every target is corrected by the detections near it, each for the probability that
    /// it is the target's own, over all ways in which they can be of the targets together.
    pub struct JointAssociationParams {
        /// Chance that a target is detected, per frame.
        pub detected: f64 = 0.9, in above(0.0).below(1.0), source "ours";
        /// False detections to be expected in a frame, anywhere in it and of any size up to e times larger or smaller than those
        /// that are true.
        pub false_alarms: f64 = 0.5, in above(0.0), unit "1/frame", source "ours";
        /// A target was detected where the detections near it are its own with this probability, all together.
        pub detected_from: f64 = 0.25, in above(0.0).below(1.0), source "ours";
        /// How many partial events are looked at in a cluster of targets that share detections; where there are more, belief
        /// propagation stands in for them.
        pub most_events: usize = 10_000, in 1..=100_000_000, source "ours";
    }
}

/// What a detection measures: centre and size.
const COMPONENTS: f64 = 4.0;

/// A false detection's width and height each vary by this on a logarithmic scale.
const SIZE_SPREAD: f64 = 2.0;

/// Probabilities over all joint events. Keeps its memory from one frame to the next.
#[derive(Default)]
pub(super) struct Joint {
    pairs: Vec<Likelihood>,
    solver: SparseJoint,
    /// `ln λ` at each detection.
    clutter: Vec<f64>,
}

impl Joint {
    pub fn associate(&mut self, pairs: &Pairs<'_>, given: &mut Given) -> Result<(), EstimationError> {
        let params = &pairs.params.joint;
        let inside = chi_square_cumulative(COMPONENTS, pairs.params.gate)?;
        let missed = 1.0 - params.detected * inside;
        // ln of P_D (2π)⁻² / (1 − P_D P_G), the part that all pairs share.
        let shared = (params.detected / missed).ln() - 0.5 * COMPONENTS * std::f64::consts::TAU.ln();
        self.clutter.clear();
        self.clutter.extend((0..pairs.detections.len()).map(|d| clutter(pairs, d)));
        self.pairs.clear();
        self.pairs.extend(pairs.near.iter().map(|pair| {
            let area = pairs.targets[pair.target].expectation.bbox().area();
            let log_determinant = pair.log_determinant + COMPONENTS * area.ln();
            let nats = shared - 0.5 * (pair.squared + log_determinant) - self.clutter[pair.detection];
            Likelihood { target: pair.target, detection: pair.detection, nats }
        }));
        let (targets, detections) = (pairs.targets.len(), pairs.detections.len());
        let found = self.solver.solve(targets, detections, &self.pairs, params.most_events)?;
        for (pair, probability) in self.pairs.iter().zip(found) {
            given.of_any[pair.detection] += probability;
            if *probability > 0.0 {
                given.shares[pair.target].push((pair.detection, *probability));
            }
        }
        for (shares, missed) in given.shares.iter_mut().zip(self.solver.missed()) {
            if 1.0 - missed < params.detected_from {
                shares.clear();
            }
        }
        Ok(())
    }
}

/// What makes a detection likely to be false: the logarithm of the density of false detections there, per pixel of each of
/// centre x, centre y, width and height.
fn clutter(pairs: &Pairs<'_>, detection: usize) -> f64 {
    let bbox = &pairs.detections[detection].bbox;
    let places = (pairs.frame.width * pairs.frame.height) as f64;
    let sizes = bbox.area() * SIZE_SPREAD * SIZE_SPREAD;
    (pairs.params.joint.false_alarms / (places * sizes)).ln()
}
