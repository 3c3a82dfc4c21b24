//! Global nearest neighbour.

use super::{AssociationParams, Given, Pairs};
use pursuit_estimation::EstimationError;
use pursuit_estimation::association::{Cost, NearestNeighbours};

pursuit_parameters::parameters! {
    /// Global nearest neighbour.
    pub struct NearestParams {
        /// Weight of one minus the overlap (IoU) with the prediction, beside the squared Mahalanobis distance; 0: the
        /// distance alone.
        pub iou_weight: f64 = 0.0, in 0.0.., source "ours";
    }
}

/// As many pairs as the gate allows; of all ways to make them the most likely one.
pub(super) struct Nearest(NearestNeighbours);

impl Nearest {
    pub fn new(params: &AssociationParams) -> Result<Self, EstimationError> {
        NearestNeighbours::new(params.gate(), Cost::MostPairs).map(Self)
    }

    pub fn associate(&mut self, pairs: &Pairs<'_>, given: &mut Given) -> Result<(), EstimationError> {
        let weight = pairs.params.nearest.iou_weight;
        let assigned = self.0.assign(pairs.distances, |t, d| weight * (1.0 - pairs.overlap(t, d)))?;
        for (target, detection) in assigned.iter().enumerate() {
            detection.iter().for_each(|d| given.give(target, *d));
        }
        Ok(())
    }
}
