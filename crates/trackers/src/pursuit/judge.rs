//! One judge over what both witnesses say of a box.

use crate::correlation::Evidence;

/// What is known of a box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Testimony {
    /// What the filter says of it.
    pub filter: Evidence,
    /// ln of s / (1 − s) of the network's score s there.
    pub network: f64,
    /// Overlap of the two witnesses' boxes.
    pub together: f64,
    /// Distance from where it was expected, in target sizes.
    pub moved: f64,
}

pursuit_tracking::parameters! {
    /// The judge: a logistic regression of what both witnesses say of a box, fitted as `docs/papers/pursuit.md` says.
    pub struct JudgeParams {
        /// Constant.
        pub bias: f64 = -5.0, in Bounds::default(), source "ours, fitted";
        /// Weight of ln of the filter's peak.
        pub peak: f64 = 1.7, in Bounds::default(), source "ours, fitted";
        /// Weight of the likeness to the initial template.
        pub likeness: f64 = 8.6, in Bounds::default(), source "ours, fitted";
        /// Weight of ln of the mean likelihood of the colours in the box.
        pub color: f64 = 0.86, in Bounds::default(), source "ours, fitted";
        /// Weight of the log odds of the network's score.
        pub network: f64 = 0.3, in Bounds::default(), source "ours, fitted";
        /// Weight of the overlap of the two witnesses' boxes.
        pub together: f64 = 2.0, in Bounds::default(), source "ours, fitted";
        /// Weight of ln of 1 and the distance from where the target was expected.
        pub moved: f64 = 0.0, in Bounds::default(), source "ours, fitted";
    }
}

/// Values below this count as this much where a logarithm is taken.
const LEAST: f64 = 1e-3;

impl JudgeParams {
    /// ln of p / (1 − p) of the probability p that the box is right.
    pub fn log_odds(&self, said: &Testimony) -> f64 {
        let ln = |v: f64| v.max(LEAST).ln();
        self.bias
            + self.peak * ln(said.filter.peak)
            + self.likeness * said.filter.likeness
            + self.color * ln(said.filter.color)
            + self.network * said.network
            + self.together * said.together
            + self.moved * said.moved.ln_1p()
    }
}
