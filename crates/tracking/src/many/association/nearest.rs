//! Global nearest neighbour, at a price for no pair.

use super::{Given, Pairs};
use pursuit_estimation::EstimationError;
use pursuit_estimation::association::{Pairing, SparseAssignment};

pursuit_parameters::parameters! {
    /// Global nearest neighbour: a pair is taken where it is more likely than that the target was missed and the detection is of
    /// something else, a new target or nothing (Blackman and Popoli 1999, section 6.4).
    pub struct NearestParams {
        /// Chance that a target is detected, per frame.
        pub detected: f64 = 0.9, in above(0.0).below(1.0), source "ours";
        /// Density of detections that are of no target that is known, new ones and false ones: how many are to be expected in a
        /// square of the target's size, with a size up to e times larger or smaller than the target's.
        pub others: f64 = 0.3, in above(0.0), source "ours";
        /// Degrees of freedom of the errors of prediction and measurement together: a t distribution, whose tails are those of the
        /// turns of cameras and of boxes that leave the picture. Many: a Gaussian.
        pub freedom: f64 = 6.0, in above(0.0), source "ours";
        /// How much better a sure detection is than an unsure one: weight of the logarithm of its odds. 0: not at all.
        pub confidence_weight: f64 = 0.25, in 0.0.., source "ours";
        /// Weight of the likeness of embeddings (cosine) beyond `look_even`, of detections that have them.
        pub look_weight: f64 = 8.0, in 0.0.., unit "nats", source "ours";
        /// The likeness that speaks neither for a pair nor against it.
        pub look_even: f64 = 0.6, in -1.0..=1.0, source "ours";
        /// Weight of the overlap (IoU) with the prediction, in nats, beside the likelihood of the distance; 0: that alone.
        pub iou_weight: f64 = 2.0, in 0.0.., unit "nats", source "ours";
    }
}

/// Of all ways to pair the most likely one.
#[derive(Default)]
pub(super) struct Nearest {
    pairings: Vec<Pairing>,
    assignment: SparseAssignment,
}

impl Nearest {
    pub fn associate(&mut self, pairs: &Pairs<'_>, given: &mut Given) -> Result<(), EstimationError> {
        let params = &pairs.params.nearest;
        // ln of P_D (2π)⁻² / ((1 − P_D) λ), the part of the likelihood ratio that all pairs share.
        let shared =
            (params.detected / (1.0 - params.detected)).ln() - 2.0 * std::f64::consts::TAU.ln() - params.others.ln();
        self.pairings.clear();
        for pair in pairs.near {
            let far = 0.5 * (params.freedom + 4.0) * (pair.squared / params.freedom).ln_1p();
            let mut nats = shared - far - 0.5 * pair.log_determinant + params.iou_weight * pair.overlap;
            if params.confidence_weight > 0.0 {
                let confidence = pairs.detections[pair.detection].confidence.clamp(1e-3, 1.0 - 1e-3);
                nats += params.confidence_weight * (confidence / (1.0 - confidence)).ln();
            }
            if let Some(likeness) = pair.likeness {
                nats += params.look_weight * (likeness - params.look_even);
            }
            self.pairings.push(Pairing { row: pair.target, column: pair.detection, cost: -nats });
        }
        let assigned = self.assignment.solve(pairs.targets.len(), pairs.detections.len(), &self.pairings)?;
        for (target, detection) in assigned.iter().enumerate() {
            detection.iter().for_each(|d| given.give(target, *d));
        }
        Ok(())
    }
}
