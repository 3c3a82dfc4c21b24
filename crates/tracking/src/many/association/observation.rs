//! By what was observed rather than by what was predicted (cao2023: OC-SORT).

use super::near::Pair;
use super::stages::{Alike, Stages};
use super::{Given, Pairs};
use pursuit_estimation::EstimationError;

pursuit_parameters::parameters! {
    /// Observation-centric: by overlap and by the direction of the boxes given lately; what is left by the overlap with the last box given; after a gap
    /// the motion model is taken through it again, along a straight line.
    pub struct ObservationParams {
        /// A detection is sure from this confidence; weak ones are given to targets seen in the frame before, and last.
        pub sure_from: f64 = 0.6, in 0.0..=1.0, source "cao2023, section 5.1";
        /// Least overlap (IoU) of a detection with a target's prediction.
        pub overlap: f64 = 0.3, in 0.0..=1.0, source "cao2023, section 5.1";
        /// λ of equation 8: weight of the direction, straight on against back, beside the overlap.
        pub direction_weight: f64 = 0.2, in 0.0.., source "cao2023, section 5.1";
        /// Δt: the direction is that over so many frames.
        pub lag: usize = 3, in 1..=15, unit "frames", source "cao2023, section 5.1";
        /// Least overlap (IoU) of a detection with the last box that a target was given, of what is left.
        pub recovery_overlap: f64 = 0.3, in 0.0..=1.0, source "cao2023, its program";
        /// Least overlap (IoU) of a weak detection with a target's prediction; above 1 weak ones are given to nobody.
        pub weak_overlap: f64 = 2.0, in 0.0..=2.0, source "cao2023, its program: off";
        /// Whether pairs of less overlap take part in the assignment, and are thrown out after it.
        pub late: bool = false, source "bewley2016, section 3.3";
        /// Whether the motion model is taken through a gap again once the target is found.
        pub update_again: bool = true, source "cao2023, section 4.1";
    }
}

/// Assigns by observations, turn by turn.
#[derive(Default)]
pub(super) struct Observation {
    stages: Stages,
    /// Targets and detections that nobody has yet; scratch.
    alone: Vec<usize>,
    left: Vec<usize>,
}

impl Observation {
    pub fn associate(&mut self, pairs: &Pairs<'_>, given: &mut Given) -> Result<(), EstimationError> {
        let params = &pairs.params.observation;
        let confidence = |pair: &Pair| pairs.detections[pair.detection].confidence;
        let sure = |pair: &Pair| confidence(pair) >= params.sure_from;
        let seen = |pair: &Pair| pairs.targets[pair.target].unseen_s == 0.0;
        self.stages.stage(pairs, given, |p| {
            if !sure(p) || p.overlap <= 0.0 || (p.overlap < params.overlap && !params.late) {
                return None;
            }
            let observed = pairs.targets[p.target].observed;
            let agreement = observed.agreement(&pairs.detections[p.detection].bbox, params.lag).unwrap_or(0.0);
            let direction = params.direction_weight * agreement * confidence(p);
            // A pair of the least overlap is better than none still; whether it is one, the overlap says alone.
            let raised = if params.late { direction } else { 1.0 + direction };
            let (likeness, least) = (p.overlap + raised, params.overlap + raised);
            Some(Alike { likeness: likeness.max(f64::MIN_POSITIVE), least, late: params.late })
        })?;
        let weak = |p: &Pair| Alike { likeness: p.overlap, least: params.weak_overlap, late: params.late };
        self.stages.stage(pairs, given, |p| (!sure(p) && seen(p)).then(|| weak(p)))?;
        self.recover(pairs, given)
    }

    /// What is left goes to whom it overlaps where that was seen last: it may have stood still.
    fn recover(&mut self, pairs: &Pairs<'_>, given: &mut Given) -> Result<(), EstimationError> {
        let params = &pairs.params.observation;
        self.alone.clear();
        self.alone.extend((0..pairs.targets.len()).filter(|t| given.shares[*t].is_empty()));
        self.left.clear();
        let sure = |d: &usize| pairs.detections[*d].confidence >= params.sure_from;
        self.left.extend((0..pairs.detections.len()).filter(|d| given.of_any[*d] == 0.0).filter(sure));
        let (alone, left) = (&self.alone, &self.left);
        let overlaps = alone.iter().flat_map(|target| {
            let last = pairs.targets[*target].observed.last();
            left.iter().filter_map(move |detection| {
                let likeness = last?.iou(&pairs.detections[*detection].bbox);
                let alike = Alike { likeness, least: params.recovery_overlap, late: params.late };
                Some((*target, *detection, alike))
            })
        });
        self.stages.assign(pairs, given, overlaps)
    }
}
