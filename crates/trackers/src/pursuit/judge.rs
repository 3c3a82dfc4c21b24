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
        pub bias: f64 = -6.2, in Bounds::default(), source "ours, fitted";
        /// Weight of ln of the filter's peak.
        pub peak: f64 = 0.0, in Bounds::default(), source "ours, fitted";
        /// Weight of the likeness to the initial template.
        pub likeness: f64 = 5.7, in Bounds::default(), source "ours, fitted";
        /// Weight of ln of the mean likelihood of the colours in the box.
        pub color: f64 = 0.0, in Bounds::default(), source "ours, fitted";
        /// Weight of the log odds of the network's score.
        pub network: f64 = 0.265, in Bounds::default(), source "ours, fitted";
        /// Weight of ln of the response's peak-to-sidelobe ratio.
        pub psr: f64 = 0.0, in Bounds::default(), source "ours, fitted";
        /// Weight of the overlap of the two witnesses' boxes.
        pub together: f64 = 3.45, in Bounds::default(), source "ours, fitted";
        /// Weight of ln of 1 and the distance from where the target was expected.
        pub moved: f64 = 0.0, in Bounds::default(), source "ours, fitted";
    }
}

/// Values below this count as this much where a logarithm is taken.
const LEAST: f64 = 1e-3;

/// The natural logarithm of what may be nought.
pub(super) fn ln(v: f64) -> f64 {
    v.max(LEAST).ln()
}

impl JudgeParams {
    /// ln of p / (1 − p) of the probability p that the box is right.
    pub fn log_odds(&self, said: &Testimony) -> f64 {
        self.bias
            + self.peak * ln(said.filter.peak)
            + self.likeness * said.filter.likeness
            + self.color * ln(said.filter.color)
            + self.network * said.network
            + self.psr * ln(said.filter.psr)
            + self.together * said.together
            + self.moved * said.moved.ln_1p()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_log_odds_are_the_weighted_sum_of_what_is_said() {
        let judge = JudgeParams {
            bias: -1.5,
            peak: 0.7,
            likeness: 3.0,
            color: 1.1,
            psr: -0.4,
            network: 0.25,
            together: 1.7,
            moved: -0.9,
        };
        let filter = Evidence { peak: 0.5, psr: 12.0, peak_ratio: 0.8, likeness: 0.6, color: 0.7 };
        let said = Testimony { filter, network: 4.0, together: 0.8, moved: 0.3 };
        let want =
            -1.5 + 0.7 * 0.5_f64.ln() + 3.0 * 0.6 + 1.1 * 0.7_f64.ln() - 0.4 * 12.0_f64.ln() + 0.25 * 4.0 + 1.7 * 0.8
                - 0.9 * 1.3_f64.ln();
        assert!((judge.log_odds(&said) - want).abs() < 1e-12);
        let silent = Evidence { peak: -0.1, psr: 0.0, color: 0.0, ..filter };
        assert!(judge.log_odds(&Testimony { filter: silent, ..said }).is_finite());
    }
}
