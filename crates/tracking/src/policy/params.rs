//! The group `[policy]`.

pursuit_parameters::choices! {
    /// How the loop judges whether the target is still seen.
    pub enum PolicyModel {
        /// By the calibrated probability that the box is right, with hysteresis.
        Calibrated = "calibrated",
        /// As `calibrated`, and the nearer to the prediction, the less the looks must prove.
        Gated = "gated",
        /// By the paper's own rule: the peak-to-sidelobe ratio where `paper.psr_from` is above 0 (bolme2010, section 3.5), else none.
        Paper = "paper",
        /// Every measurement is believed and learned, nothing is ever lost.
        Always = "always",
    }
}

pursuit_parameters::parameters! {
    /// How the loop judges what it found.
    pub struct PolicyParams {
        /// The rule.
        pub model: PolicyModel = PolicyModel::Calibrated, source "ours";
        /// A target that is seen counts as unsure or occluded below this probability.
        pub occluded_below: f64 = 0.4, in 0.0..=1.0, source "ours", of BY_PROBABILITY;
        /// An unsure or occluded target counts as seen again from this probability.
        pub seen_from: f64 = 0.5, in 0.0..=1.0, source "ours", of BY_PROBABILITY;
        /// A lost target counts as found from this probability.
        pub found_from: f64 = 0.5, in 0.0..=1.0, source "ours", of BY_PROBABILITY;
        /// Appearance is learned from this probability.
        pub learn_from: f64 = 0.4, in 0.0..=1.0, source "ours", of BY_PROBABILITY;
        /// A target unsure or occluded for longer is lost, and searched for all over.
        pub lost_after_s: f64 = 1.0, in 0.0.., unit "s", source "ours", of LOSING;
        /// For so long after it was found again nothing is learned of a target, and what is doubted is lost at once.
        pub probation_s: f64 = 0.0, in 0.0.., unit "s", source "ours", of LOSING;
        /// Most that the score of an unsure or occluded target may be: what looks good enough to stay seen but not to be seen again is
        /// right less often than its probability says (14 to 47 % of such frames where the probability was 41 % on average).
        pub occluded_score: f64 = 0.35, in 0.0..=1.0, source "ours", of LOSING;
        /// By the probability alone.
        pub calibrated: CalibratedParams = CalibratedParams::default(), of [PolicyModel::Calibrated];
        /// By the probability and the distance from the prediction.
        pub gated: GatedParams = GatedParams::default(), of [PolicyModel::Gated];
        /// By the paper's rule.
        pub paper: PaperParams = PaperParams::default(), of [PolicyModel::Paper];
    }
    renamed {
        "learn_unsure_from" => ["calibrated.learn_unsure_from"],
        "lost_below" => ["calibrated.lost_below"],
        "far_from" => ["gated.far_from"],
        "outside_haste" => ["gated.outside_haste"],
        "psr_from" => ["paper.psr_from"],
    }
}

impl PolicyParams {
    /// Of methods that bear a long doubt, in which they follow what is likeliest, better than they find a target again all over the frame.
    pub fn patient() -> Self {
        let calibrated = CalibratedParams { lost_below: 0.2, ..CalibratedParams::default() };
        Self { lost_after_s: 2.0, calibrated, ..Self::default() }
    }
}

/// The models that judge by the calibrated probability.
const BY_PROBABILITY: [PolicyModel; 2] = [PolicyModel::Calibrated, PolicyModel::Gated];
/// The models that lose a target.
const LOSING: [PolicyModel; 3] = [PolicyModel::Calibrated, PolicyModel::Gated, PolicyModel::Paper];

pursuit_parameters::parameters! {
    /// The policy `calibrated`.
    pub struct CalibratedParams {
        /// What is followed in doubt, without being called seen, is learned from this probability. Of methods that check for
        /// themselves what they learn (kalal2012); above 1: never.
        pub learn_unsure_from: f64 = 2.0, in 0.0..=2.0, source "ours";
        /// Time counts towards losing an unsure or occluded target while the probability is below this; 1: always.
        pub lost_below: f64 = 1.0, in 0.0..=1.0, source "ours";
        /// What is less likely than this moves no box: the motion model says where the target is meanwhile.
        pub follow_from: f64 = 0.0, in 0.0..=1.0, source "ours";
        /// A target that was not sure for so long is looked for elsewhere as well, while the best guess is followed.
        pub elsewhere_after_s: f64 = 1e6, in 0.0.., unit "s", source "ours";
    }
}

pursuit_parameters::parameters! {
    /// The policy `gated`.
    pub struct GatedParams {
        /// Asked of what lies at the gate's edge after the target was missed.
        pub far_from: f64 = 0.925, in 0.0..=1.0, source "ours";
        /// While the target is predicted outside of the frame, where waiting is of no use, time counts this often.
        pub outside_haste: f64 = 4.0, in above(0.0), source "ours";
    }
}

pursuit_parameters::parameters! {
    /// The policy `paper`.
    pub struct PaperParams {
        /// A peak-to-sidelobe ratio below this is no target; 0 asks nothing.
        pub psr_from: f64 = 0.0, in 0.0.., source "bolme2010, section 3.5";
    }
}
