//! One judge over what both witnesses say of a box.

use super::JudgeParams;
use crate::correlation::Evidence;

/// What is known of a box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointEvidence {
    /// What the filter says of it.
    pub filter: Evidence,
    /// ln of s / (1 − s) of the network's score s there.
    pub network: f64,
    /// Overlap of the two witnesses' boxes.
    pub overlap: f64,
    /// Distance from where it was expected, in target sizes.
    pub moved: f64,
}

/// Values below this count as this much where a logarithm is taken.
const LEAST: f64 = 1e-3;

/// The natural logarithm of what may be nought.
pub(super) fn ln(v: f64) -> f64 {
    v.max(LEAST).ln()
}

impl JudgeParams {
    /// ln of p / (1 − p) of the probability p that the box is right.
    pub fn log_odds(&self, evidence: &JointEvidence) -> f64 {
        self.bias
            + self.peak * ln(evidence.filter.peak)
            + self.likeness * evidence.filter.likeness
            + self.color * ln(evidence.filter.color)
            + self.network * evidence.network
            + self.psr * ln(evidence.filter.psr)
            + self.overlap * evidence.overlap
            + self.moved * evidence.moved.ln_1p()
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
            overlap: 1.7,
            moved: -0.9,
        };
        let filter = Evidence { peak: 0.5, psr: 12.0, peak_ratio: 0.8, likeness: 0.6, color: 0.7 };
        let evidence = JointEvidence { filter, network: 4.0, overlap: 0.8, moved: 0.3 };
        let want =
            -1.5 + 0.7 * 0.5_f64.ln() + 3.0 * 0.6 + 1.1 * 0.7_f64.ln() - 0.4 * 12.0_f64.ln() + 0.25 * 4.0 + 1.7 * 0.8
                - 0.9 * 1.3_f64.ln();
        assert!((judge.log_odds(&evidence) - want).abs() < 1e-12);
        let silent = Evidence { peak: -0.1, psr: 0.0, color: 0.0, ..filter };
        assert!(judge.log_odds(&JointEvidence { filter: silent, ..evidence }).is_finite());
    }
}
