//! The group `[policy]`.

crate::choices! {
    /// How the loop judges whether the target is still seen.
    pub enum PolicyModel {
        /// By the calibrated probability that the box is right, with hysteresis.
        Calibrated = "calibrated",
        /// As `calibrated`, and the nearer to the prediction, the less the looks must prove.
        Gated = "gated",
        /// By the paper's own rule: the peak-to-sidelobe ratio where `psr_from` is above 0 (bolme2010, section 3.5), else none.
        Paper = "paper",
        /// Every measurement is believed and learned, nothing is ever lost.
        Always = "always",
    }
}

crate::parameters! {
    /// How the loop judges what it found.
    pub struct PolicyParams {
        /// The rule.
        pub model: PolicyModel = PolicyModel::Calibrated, source "ours";
        /// A target that is seen counts as occluded below this probability.
        pub occluded_below: f64 = 0.4, in 0.0..=1.0, source "ours";
        /// An occluded target counts as seen again from this probability.
        pub seen_from: f64 = 0.5, in 0.0..=1.0, source "ours";
        /// A lost target counts as found from this probability.
        pub found_from: f64 = 0.5, in 0.0..=1.0, source "ours";
        /// Appearance is learned from this probability.
        pub learn_from: f64 = 0.4, in 0.0..=1.0, source "ours";
        /// Of `calibrated`: what is followed in doubt, without being called seen, is learned from this probability. Of methods
        /// that check for themselves what they learn (kalal2012); above 1: never.
        pub learn_unsure_from: f64 = 2.0, in 0.0..=2.0, source "ours";
        /// Of `gated`: asked of what lies at the gate's edge after the target was missed.
        pub far_from: f64 = 0.925, in 0.0..=1.0, source "ours";
        /// Time counts towards losing an occluded target while the probability is below this; 1: always.
        pub lost_below: f64 = 1.0, in 0.0..=1.0, source "ours";
        /// A target occluded for longer is lost, and searched for all over.
        pub lost_after_s: f64 = 1.0, in 0.0.., unit "s", source "ours";
        /// Most that the score of an occluded target may be: what looks good enough to stay seen but not to be seen again is
        /// right less often than its probability says (14 to 47 % of such frames where the probability was 41 % on average).
        pub occluded_score: f64 = 0.35, in 0.0..=1.0, source "ours";
        /// Of `paper`: a peak-to-sidelobe ratio below this is no target; 0 asks nothing.
        pub psr_from: f64 = 0.0, in 0.0.., source "bolme2010, section 3.5";
        /// Of `gated`: while the target is predicted outside of the frame, where waiting is of no use, time counts this often.
        pub outside_haste: f64 = 4.0, in above(0.0), source "ours";
    }
}
