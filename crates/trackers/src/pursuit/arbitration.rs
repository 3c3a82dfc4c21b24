//! Whom to follow where the witnesses disagree.

use super::judge::{Testimony, ln};
use serde::{Deserialize, Serialize};

pursuit_tracking::parameters! {
    /// Whom to follow where the witnesses disagree: a logistic regression of the differences between what is known of the
    /// filter's box and of the network's, fitted to the frames of real sequences where they disagree and one is right.
    pub struct RivalryParams {
        /// Log odds for the filter where nothing speaks for either.
        pub bias: f64 = -1.4, in Bounds::default(), source "ours, fitted";
        /// Weight of the difference of ln of the filter's peak.
        pub peak: f64 = 1.1, in Bounds::default(), source "ours, fitted";
        /// Weight of the difference of ln of the mean likelihood of the colours.
        pub color: f64 = 1.1, in Bounds::default(), source "ours, fitted";
        /// Weight of the difference of the log odds of the network's score.
        pub network: f64 = 0.12, in Bounds::default(), source "ours, fitted";
        /// Share of a frame in what is remembered of the rivalry.
        pub rate: f64 = 0.2, in above(0.0).at_most(1.0), source "ours";
        /// How much what is remembered counts beside the frame at hand.
        pub memory: f64 = 1.0, in 0.0.., source "ours";
        /// From this on, in log odds remembered, the loser is put where the winner is.
        pub settled_from: f64 = 1.0, in 0.0.., unit "log odds", source "ours";
    }
}

/// What is remembered of the frames in which the witnesses disagreed.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(try_from = "f64", into = "f64")]
pub struct Rivalry {
    /// Smoothed log odds for the filter, within ±[`MOST`].
    filter: f64,
}

/// One frame is no more than this, in log odds.
const MOST: f64 = 6.0;

impl From<Rivalry> for f64 {
    fn from(rivalry: Rivalry) -> Self {
        rivalry.filter
    }
}

impl TryFrom<f64> for Rivalry {
    type Error = &'static str;

    fn try_from(filter: f64) -> Result<Self, Self::Error> {
        if filter.abs() <= MOST { Ok(Self { filter }) } else { Err("a rivalry is out of range") }
    }
}

impl Rivalry {
    /// Log odds, by this frame alone, that the filter's box is the right one of two.
    pub fn now(params: &RivalryParams, filter: &Testimony, network: &Testimony) -> f64 {
        let odds = params.bias
            + params.peak * (ln(filter.filter.peak) - ln(network.filter.peak))
            + params.color * (ln(filter.filter.color) - ln(network.filter.color))
            + params.network * (filter.network - network.network);
        odds.clamp(-MOST, MOST)
    }

    /// Whether the filter is to be followed in a frame of which [`now`](Self::now) is `odds`.
    pub fn filter_leads(&self, params: &RivalryParams, odds: f64) -> bool {
        odds + params.memory * self.filter > 0.0
    }

    /// Remembers a frame: `odds` where they disagreed, 0 where they agreed.
    pub fn remember(&mut self, params: &RivalryParams, odds: f64) {
        self.filter += params.rate * (odds - self.filter);
    }

    /// Whether it is settled that the filter is right (`Some(true)`) or the network (`Some(false)`).
    pub fn settled(&self, params: &RivalryParams) -> Option<bool> {
        (self.filter.abs() >= params.settled_from).then_some(self.filter > 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::correlation::Evidence;

    fn said(peak: f64, color: f64, network: f64) -> Testimony {
        let filter = Evidence { peak, psr: 10.0, peak_ratio: 1.0, likeness: 0.7, color };
        Testimony { filter, network, together: 0.0, moved: 0.0 }
    }

    #[test]
    fn the_odds_are_the_weighted_differences() {
        let params = RivalryParams { bias: -0.5, peak: 2.0, color: 0.8, network: 0.3, ..RivalryParams::default() };
        let odds = Rivalry::now(&params, &said(0.9, 0.6, 3.0), &said(0.3, 0.8, 7.0));
        let want = -0.5 + 2.0 * 3.0_f64.ln() + 0.8 * (0.6_f64 / 0.8).ln() - 0.3 * 4.0;
        assert!((odds - want).abs() < 1e-12, "{odds} {want}");
        assert_eq!(Rivalry::now(&params, &said(0.9, 0.6, 300.0), &said(0.3, 0.8, 7.0)), 6.0);
        assert_eq!(Rivalry::now(&params, &said(0.9, 0.6, -300.0), &said(0.3, 0.8, 7.0)), -6.0);
    }

    #[test]
    fn who_was_right_is_believed_until_it_is_settled() {
        let params = RivalryParams { rate: 0.25, memory: 2.0, settled_from: 1.5, ..RivalryParams::default() };
        let mut rivalry = Rivalry::default();
        assert!(rivalry.filter_leads(&params, 0.1) && !rivalry.filter_leads(&params, -0.1));
        rivalry.remember(&params, 4.0);
        assert_eq!((f64::from(rivalry), rivalry.settled(&params)), (1.0, None));
        assert!(rivalry.filter_leads(&params, -1.9) && !rivalry.filter_leads(&params, -2.1));
        rivalry.remember(&params, 4.0);
        assert_eq!((f64::from(rivalry), rivalry.settled(&params)), (1.75, Some(true)));
        for _ in 0..9 {
            rivalry.remember(&params, -4.0);
        }
        assert_eq!(rivalry.settled(&params), Some(false));
        let before = f64::from(rivalry);
        rivalry.remember(&params, 0.0);
        assert_eq!(f64::from(rivalry), 0.75 * before);
        assert!(Rivalry::try_from(6.1).is_err() && Rivalry::try_from(f64::NAN).is_err());
        assert_eq!(Rivalry::try_from(-2.5).map(f64::from), Ok(-2.5));
    }
}
