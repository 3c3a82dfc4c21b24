//! The groups `[many]` and `[acquire]`.

use crate::motion::MotionParams;
use crate::policy::{PolicyModel, PolicyParams};

crate::parameters! {
    /// How detections are made into targets: association, births and deaths.
    pub struct AssociationParams {
        /// Detections less likely than this are passed over.
        pub least_confidence: f64 = 0.1, in 0.0..=1.0, source "ours";
        /// Less likely detections continue targets, but start none.
        pub birth_from: f64 = 0.5, in 0.0..=1.0, source "ours";
        /// Squared Mahalanobis distance of centre and size from the prediction beyond which a detection is not the target's.
        pub gate: f64 = 13.277, in above(0.0), source "99 % of χ² with 4 degrees of freedom";
        /// Farther from its prediction than this no target is found again, however long it was out of sight.
        pub reach: f64 = 4.0, in above(0.0), unit "sizes", source "ours";
        /// Weight of one minus the overlap (IoU) with the prediction, beside the squared Mahalanobis distance; 0: the
        /// distance alone.
        pub iou_weight: f64 = 0.0, in 0.0.., source "ours";
        /// How often a detector that tells classes apart takes a thing for one of another class: a detection of a class other
        /// than the target's is farther by minus twice the logarithm of it.
        pub other_class: f64 = 0.05, in above(0.0).at_most(1.0), source "ours";
        /// A detection that overlaps a target by more (IoU) is that target seen twice, and starts no other.
        pub crowding: f64 = 0.5, in 0.0..=1.0, source "ours";
        /// M of M-of-N: a candidate is a target once it was detected in this many of the last `confirm_looks` frames.
        pub confirm_hits: usize = 3, in 1..=64, unit "frames", source "ours";
        /// N of M-of-N.
        pub confirm_looks: usize = 5, in 1..=64, unit "frames", source "ours";
        /// A target that was not seen for longer is given up, and its id with it.
        pub dies_after_s: f64 = 3.0, in 0.0.., unit "s", source "ours";
        /// For so long after its last detection a target may be followed by its appearance alone.
        pub appearance_s: f64 = 2.0, in 0.0.., unit "s", source "ours";
        /// When appearance and detection overlap by less (IoU), appearance is started anew on the detection.
        pub appearance_overlap: f64 = 0.3, in 0.0..=1.0, source "ours";
        /// How targets move between detections.
        pub motion: MotionParams = detected_motion();
        /// When an undetected target counts as occluded, and when as lost.
        pub policy: PolicyParams = detected_policy();
    }
    ordered { confirm_hits <= confirm_looks }
}

/// Detectors draw boxes less exactly than trackers do; what they find walks or drives.
fn detected_motion() -> MotionParams {
    MotionParams {
        acceleration: 5.0,
        start_speed: 3.0,
        position_noise: 0.06,
        size_noise: 0.12,
        noise_floor_px: 0.5,
        ..MotionParams::default()
    }
}

/// What was associated is believed; the rest of the policy is as for any target.
fn detected_policy() -> PolicyParams {
    PolicyParams {
        model: PolicyModel::Gated,
        occluded_below: 0.0,
        seen_from: 0.0,
        found_from: 0.0,
        far_from: 0.0,
        ..PolicyParams::default()
    }
}

crate::parameters! {
    /// How one target that a detector finds is made sure of: a sequential probability ratio test (Wald 1945) of each
    /// hypothesis against clutter.
    pub struct AcquisitionParams {
        /// Hypotheses followed at once while none is sure.
        pub most_hypotheses: usize = 4, in 1..=64, source "ours";
        /// Detections less likely than this start no hypothesis.
        pub start_from: f64 = 0.0, in 0.0..=1.0, source "ours";
        /// A detection belongs to the hypothesis that it overlaps most, if by at least this (IoU).
        pub overlap: f64 = 0.3, in above(0.0).at_most(1.0), source "ours";
        /// Chance that the true target is detected where it is followed, per frame.
        pub detected: f64 = 0.8, in above(0.0).below(1.0), source "ours";
        /// Chance that clutter is detected again where it is followed, once it has moved.
        pub false_moving: f64 = 0.25, in above(0.0).below(1.0), source "ours";
        /// The same of clutter that stands still, as most clutter does.
        pub false_still: f64 = 0.65, in above(0.0).below(1.0), source "ours";
        /// A hypothesis has moved once it was this far from its start.
        pub moves: f64 = 1.0, in above(0.0), unit "sizes", source "ours";
        /// Error of the first kind: the share of clutter that may be taken for the target.
        pub false_start: f64 = 0.01, in above(0.0).below(0.5), source "ours";
        /// Error of the second kind: the share of true targets that may be dropped.
        pub false_drop: f64 = 0.05, in above(0.0).below(0.5), source "ours";
        /// A rival takes over when its evidence exceeds the leader's by this.
        pub lead: f64 = 2.0, in 0.0.., unit "nats", source "ours";
        /// A leader whom nothing has confirmed or refuted for so long is taken for the target.
        pub trial_s: f64 = 1.0, in 0.0.., unit "s", source "ours";
        /// Of detectors that model the scene, and so see every frame: when the target's box overlaps theirs by less (IoU) …
        pub agree: f64 = 0.45, in 0.0..=1.0, source "ours";
        /// … for longer than this, the target is put onto theirs.
        pub apart_s: f64 = 0.3, in 0.0.., unit "s", source "ours";
        /// A target that is lost for longer is sought by the detector again; what it finds must be confirmed.
        pub seek_again_after_s: f64 = 1.0, in 0.0.., unit "s", source "ours";
    }
}
