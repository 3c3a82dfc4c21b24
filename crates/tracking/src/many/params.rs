//! The groups `[many]` and `[acquire]`.

use super::{
    AssociationParams, BirthModel, BirthParams, DeathParams, DoublesParams, EmbeddingParams, HitsParams, WholeParams,
};
use crate::motion::MotionParams;
use crate::policy::{GatedParams, PolicyModel, PolicyParams};

pursuit_parameters::choices! {
    /// Which box is reported of a target that was detected.
    pub enum ReportedBox {
        /// The detection's own.
        Measured = "measured",
        /// The motion model's, corrected by the detection.
        Filtered = "filtered",
    }
}

pursuit_parameters::parameters! {
    /// How detections are made into targets.
    pub struct ManyParams {
        /// Which box is reported of a target that was detected.
        pub reported as "box": ReportedBox = ReportedBox::Measured, source "ours";
        /// A target that was missed is reported again once it was detected in so many frames, one after the other; 0 and 1: at once.
        pub reported_from: usize = 0, in 0..=15, unit "frames", source "bewley2016, its program: 3";
        /// For so long after its last detection a target may be followed by its appearance alone.
        pub appearance_s: f64 = 2.0, in 0.0.., unit "s", source "ours";
        /// Where nothing was detected, what appearance sees is believed from this probability.
        pub appearance_from: f64 = 0.4, in 0.0..=1.0, source "ours";
        /// When appearance and detection overlap by less (IoU), appearance is started anew on the detection.
        pub appearance_overlap: f64 = 0.3, in 0.0..=1.0, source "ours";
        /// Which detection is of which target.
        pub association: AssociationParams = AssociationParams::default();
        /// What detections look like, of those that come without an embedding.
        pub embedding: EmbeddingParams = EmbeddingParams::default();
        /// When what a detector finds becomes a target.
        pub birth: BirthParams = BirthParams::default();
        /// When a target is given up.
        pub death: DeathParams = DeathParams::default();
        /// What becomes of parts, of detectors that model the scene.
        pub whole: WholeParams = WholeParams::default();
        /// When two targets are one thing.
        pub doubles: DoublesParams = DoublesParams::default();
        /// How targets move between detections.
        pub motion: MotionParams = detected_motion();
        /// When an undetected target counts as unsure or occluded, and when as lost.
        pub policy: PolicyParams = detected_policy();
    }
    renamed {
        "least_confidence" => ["association.least_confidence"],
        "gate" => ["association.gate"],
        "reach" => ["association.reach"],
        "other_class" => ["association.other_class"],
        "iou_weight" => ["association.nearest.iou_weight"],
        "birth_from" => ["birth.from"],
        "crowding" => ["birth.crowding"],
        "confirm_hits" => ["birth.hits.hits"],
        "confirm_looks" => ["birth.hits.looks"],
        "dies_after_s" => ["death.unseen.after_s"],
    }
}

impl ManyParams {
    /// For detectors whose confidences are shares of some measure and no chances, such as those that model the background: a
    /// candidate is confirmed by how often it was detected, three times in five frames, so that it could have started a target each time.
    /// `motion` says how things move.
    pub fn counting(motion: MotionParams) -> Self {
        let from = 0.5;
        let hits = HitsParams { from, ..HitsParams::default() };
        let birth = BirthParams { model: BirthModel::Hits, from, hits, ..BirthParams::default() };
        Self { motion, birth, ..Self::default() }
    }
}

/// Detectors draw boxes less exactly than trackers do; what they find walks or drives, and cameras turn suddenly.
fn detected_motion() -> MotionParams {
    MotionParams {
        acceleration: 0.1,
        agile: 8.0,
        agile_from: 28.0,
        wander: 0.07,
        start_speed: 20.0,
        position_noise: 0.035,
        size_noise: 0.09,
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
        gated: GatedParams { far_from: 0.0, ..GatedParams::default() },
        ..PolicyParams::default()
    }
}

pursuit_parameters::parameters! {
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
        /// A target that is lost for longer is sought by the detector again; what it finds must be confirmed.
        pub seek_again_after_s: f64 = 1.0, in 0.0.., unit "s", source "ours";
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_parameters::Parameters;

    #[test]
    fn former_names_mean_the_new_ones() {
        let with = |text: &str| ManyParams::default().with("many", &text.parse().unwrap());
        let former = "birth.model = 'hits'\ngate = 1\nreach = 2\niou_weight = 3\nconfirm_hits = 2\ndies_after_s = 4";
        let now = "birth.model = 'hits'\nassociation.gate = 1\nassociation.reach = 2\nassociation.nearest.iou_weight = 3\nbirth.hits.hits = 2\n\
                   death.unseen.after_s = 4";
        assert_eq!(with(former).unwrap(), with(now).unwrap());
        let both = with("gate = 2.0\nassociation.gate = 3.0\nassociation.reach = 5.0").unwrap();
        assert_eq!((both.association.gate, both.association.reach), (3.0, 5.0), "the new name counts more");
        assert!(with("gait = 1").unwrap_err().to_string().contains("there are: box, reported_from, appearance_s"));
    }
}
