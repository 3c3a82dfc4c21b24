//! Whom to follow where the witnesses disagree.

use super::ArbitrationParams;
use super::judge::JointEvidence;
use pursuit_tracking::Taken;
use serde::{Deserialize, Serialize};

/// What is remembered of the frames in which the witnesses disagreed.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(try_from = "f64", into = "f64")]
pub struct Arbitration {
    /// Smoothed log odds for the filter; finite.
    filter: f64,
}

impl From<Arbitration> for f64 {
    fn from(arbitration: Arbitration) -> Self {
        arbitration.filter
    }
}

impl TryFrom<f64> for Arbitration {
    type Error = &'static str;

    fn try_from(filter: f64) -> Result<Self, Self::Error> {
        if filter.is_finite() {
            Ok(Self { filter })
        } else {
            Err("the log odds remembered of an arbitration are not finite")
        }
    }
}

impl Arbitration {
    /// Log odds, by this frame alone, that the filter's box is the right one of two.
    pub fn now(params: &ArbitrationParams, filter: &JointEvidence, network: &JointEvidence) -> f64 {
        let ln = |v| Taken::Ln.of(v);
        let odds = params.bias
            + params.peak * (ln(filter.peak) - ln(network.peak))
            + params.color * (ln(filter.color) - ln(network.color))
            + params.network * (filter.network - network.network);
        odds.clamp(-params.frame_limit, params.frame_limit)
    }

    /// Whether the filter is to be followed in a frame of which [`now`](Self::now) is `odds`.
    pub fn filter_leads(&self, params: &ArbitrationParams, odds: f64) -> bool {
        odds + params.memory * self.filter > 0.0
    }

    /// Remembers a frame: `odds` where they disagreed, 0 where they agreed.
    pub fn remember(&mut self, params: &ArbitrationParams, odds: f64) {
        self.filter += params.rate * (odds - self.filter);
    }

    /// Whether it is settled that the filter is right (`Some(true)`) or the network (`Some(false)`).
    pub fn settled(&self, params: &ArbitrationParams) -> Option<bool> {
        (self.filter.abs() >= params.settled_from).then_some(self.filter > 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn evidence(peak: f64, color: f64, network: f64) -> JointEvidence {
        JointEvidence { peak, color, network, ..JointEvidence::default() }
    }

    #[test]
    fn the_odds_are_the_weighted_differences() {
        let params =
            ArbitrationParams { bias: -0.5, peak: 2.0, color: 0.8, network: 0.3, ..ArbitrationParams::default() };
        let odds = Arbitration::now(&params, &evidence(0.9, 0.6, 3.0), &evidence(0.3, 0.8, 7.0));
        let want = -0.5 + 2.0 * 3.0_f64.ln() + 0.8 * (0.6_f64 / 0.8).ln() - 0.3 * 4.0;
        assert!((odds - want).abs() < 1e-12, "{odds} {want}");
        assert_eq!(Arbitration::now(&params, &evidence(0.9, 0.6, 300.0), &evidence(0.3, 0.8, 7.0)), 6.0);
        assert_eq!(Arbitration::now(&params, &evidence(0.9, 0.6, -300.0), &evidence(0.3, 0.8, 7.0)), -6.0);
    }

    #[test]
    fn who_was_right_is_believed_until_settled() {
        let params = ArbitrationParams { rate: 0.25, memory: 2.0, settled_from: 1.5, ..ArbitrationParams::default() };
        let mut arbitration = Arbitration::default();
        assert!(arbitration.filter_leads(&params, 0.1) && !arbitration.filter_leads(&params, -0.1));
        arbitration.remember(&params, 4.0);
        assert_eq!((f64::from(arbitration), arbitration.settled(&params)), (1.0, None));
        assert!(arbitration.filter_leads(&params, -1.9) && !arbitration.filter_leads(&params, -2.1));
        arbitration.remember(&params, 4.0);
        assert_eq!((f64::from(arbitration), arbitration.settled(&params)), (1.75, Some(true)));
        for _ in 0..9 {
            arbitration.remember(&params, -4.0);
        }
        assert_eq!(arbitration.settled(&params), Some(false));
        let before = f64::from(arbitration);
        arbitration.remember(&params, 0.0);
        assert_eq!(f64::from(arbitration), 0.75 * before);
        assert!(Arbitration::try_from(f64::INFINITY).is_err() && Arbitration::try_from(f64::NAN).is_err());
        assert_eq!(Arbitration::try_from(-2.5).map(f64::from), Ok(-2.5));
    }
}
