//! Joint probabilistic data association.

use super::{AssociationParams, Given, Pairs};
use pursuit_estimation::EstimationError;
use pursuit_estimation::association::{Distances, JointParams, JointProbabilities};

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

/// A false detection's width and height each vary by this on a logarithmic scale.
const SIZE_SPREAD: f64 = 2.0;

/// Probabilities over all joint events.
pub(super) struct Joint {
    probabilities: JointProbabilities,
    distances: Distances,
}

impl Joint {
    pub fn new(params: &AssociationParams) -> Result<Self, EstimationError> {
        let JointAssociationParams { detected, most_events, .. } = params.joint;
        let gate = params.gate();
        // The density of clutter differs from detection to detection; it joins what speaks against each pair.
        let joint = JointParams { detection_probability: detected, clutter_density: 1.0, gate, most_events };
        Ok(Self { probabilities: JointProbabilities::new(joint)?, distances: Distances::new() })
    }

    pub fn associate(&mut self, pairs: &Pairs<'_>, given: &mut Given) -> Result<(), EstimationError> {
        let params = &pairs.params.joint;
        let expected: Vec<_> = pairs.targets.iter().map(|t| *t.expectation.measurement()).collect();
        self.distances.start(&expected, pairs.detections.len())?;
        for pair in pairs.near {
            self.distances.set(pair.target, pair.detection, pair.squared);
        }
        let probabilities = self.probabilities.among(&self.distances, |_, d| clutter(pairs, d))?;
        for (target, shares) in given.shares.iter_mut().enumerate() {
            let Some([missed, own @ ..]) = probabilities.of(target) else { continue };
            for (sum, probability) in given.of_any.iter_mut().zip(own) {
                *sum += probability;
            }
            if 1.0 - missed >= params.detected_from {
                shares.extend(own.iter().copied().enumerate().filter(|(_, probability)| *probability > 0.0));
            }
        }
        Ok(())
    }
}

/// What makes a detection likely to be false: twice the logarithm of the density of false detections there, per pixel of each of
/// centre x, centre y, width and height.
fn clutter(pairs: &Pairs<'_>, detection: usize) -> f64 {
    let bbox = &pairs.detections[detection].bbox;
    let places = (pairs.frame.width * pairs.frame.height) as f64;
    let sizes = bbox.area() * SIZE_SPREAD * SIZE_SPREAD;
    2.0 * (pairs.params.joint.false_alarms / (places * sizes)).ln()
}
