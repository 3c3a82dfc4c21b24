//! One judge over what both witnesses say of a box.

use super::JudgeParams;
use crate::correlation::Evidence;
use serde::{Deserialize, Serialize};

/// What is known of a box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointEvidence {
    /// What the filter says of it.
    pub filter: Evidence,
    /// ln of s / (1 − s) of the network's score s there.
    pub network: f64,
    /// The running mean of that over the frames in which the target was followed, with this one; see [`NetworkMemory`].
    pub network_mean: f64,
    /// Overlap of the two witnesses' boxes.
    pub overlap: f64,
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
            + self.network * evidence.network_mean
            + self.psr * ln(evidence.filter.psr)
            + self.overlap * evidence.overlap
    }
}

/// The running mean of what the network said of what was followed: its answers differ from frame to frame by more than how
/// right they are. Nothing where the target was lost in between.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(try_from = "Option<f64>", into = "Option<f64>")]
pub(super) struct NetworkMemory(Option<f64>);

impl From<NetworkMemory> for Option<f64> {
    fn from(memory: NetworkMemory) -> Self {
        memory.0
    }
}

impl TryFrom<Option<f64>> for NetworkMemory {
    type Error = &'static str;

    fn try_from(mean: Option<f64>) -> Result<Self, Self::Error> {
        if mean.is_none_or(f64::is_finite) { Ok(Self(mean)) } else { Err("the network's mean answer is not finite") }
    }
}

impl NetworkMemory {
    /// Of a target that was followed, in a frame where [`JointEvidence::network_mean`] is `mean`.
    pub const fn of(mean: f64) -> Self {
        Self(Some(mean))
    }

    /// The mean with an answer of log odds `now`.
    pub fn mean_with(self, params: &JudgeParams, now: f64) -> f64 {
        self.0.map_or(now, |mean| mean + params.network_rate * (now - mean))
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
            network_rate: 0.5,
        };
        let filter = Evidence { peak: 0.5, psr: 12.0, peak_ratio: 0.8, likeness: 0.6, color: 0.7 };
        let evidence = JointEvidence { filter, network: 7.0, network_mean: 4.0, overlap: 0.8 };
        let want =
            -1.5 + 0.7 * 0.5_f64.ln() + 3.0 * 0.6 + 1.1 * 0.7_f64.ln() - 0.4 * 12.0_f64.ln() + 0.25 * 4.0 + 1.7 * 0.8;
        assert!((judge.log_odds(&evidence) - want).abs() < 1e-12);
        let silent = Evidence { peak: -0.1, psr: 0.0, color: 0.0, ..filter };
        assert!(judge.log_odds(&JointEvidence { filter: silent, ..evidence }).is_finite());
    }

    #[test]
    fn the_network_is_believed_by_the_mean_of_its_answers() {
        let params = JudgeParams { network_rate: 0.25, ..JudgeParams::default() };
        let nothing = NetworkMemory::default();
        assert_eq!(nothing.mean_with(&params, 3.0), 3.0);
        let mean = NetworkMemory::of(3.0).mean_with(&params, -1.0);
        assert_eq!(mean, 2.0);
        assert_eq!(NetworkMemory::of(mean).mean_with(&params, 2.0), 2.0);
        let read = |m: NetworkMemory| postcard::from_bytes::<NetworkMemory>(&postcard::to_stdvec(&m).unwrap());
        assert_eq!(read(nothing).unwrap(), nothing);
        assert_eq!(read(NetworkMemory::of(-2.5)).unwrap(), NetworkMemory::of(-2.5));
        assert!(read(NetworkMemory::of(f64::NAN)).is_err());
    }
}
