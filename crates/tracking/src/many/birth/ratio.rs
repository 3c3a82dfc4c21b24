//! The sequential probability ratio test (Wald 1945).

use serde::{Deserialize, Serialize};

pursuit_parameters::parameters! {
    /// A sequential probability ratio test of each candidate against clutter: what is detected more surely is confirmed sooner.
    pub struct RatioParams {
        /// The confidence of a detection that speaks neither for a target nor against it.
        pub even: f64 = 0.75, in above(0.0).below(1.0), source "ours";
        /// What the logarithm of a confidence's odds beyond those of `even` counts.
        pub weight: f64 = 0.65, in 0.0.., source "ours";
        /// Most that one detection may say either way.
        pub most: f64 = 4.0, in above(0.0), unit "nats", source "ours";
        /// Chance that a target is detected where it is expected, per frame.
        pub detected: f64 = 0.9, in above(0.0).below(1.0), source "ours";
        /// Chance that clutter is detected again where it is expected, per frame.
        pub false_again: f64 = 0.5, in above(0.0).below(1.0), source "ours";
        /// Error of the first kind: the share of clutter that may be taken for a target.
        pub false_start: f64 = 0.05, in above(0.0).below(0.5), source "ours";
        /// Error of the second kind: the share of targets that may be dropped.
        pub false_drop: f64 = 0.05, in above(0.0).below(0.5), source "ours";
    }
}

impl RatioParams {
    /// What a detection of this confidence says for a target against clutter, in nats; `None`: it was missed.
    pub(in crate::many) fn nats(&self, confidence: Option<f64>) -> f64 {
        let odds = |c: f64| {
            let c = c.clamp(1e-6, 1.0 - 1e-6);
            (c / (1.0 - c)).ln()
        };
        match confidence {
            Some(c) => {
                let again = (self.detected / self.false_again).ln();
                again + (self.weight * (odds(c) - odds(self.even))).clamp(-self.most, self.most)
            }
            None => ((1.0 - self.detected) / (1.0 - self.false_again)).ln(),
        }
    }
}

/// What is tested, and which errors may be made.
#[derive(Debug, Clone, Copy)]
pub(in crate::many) struct RatioTest {
    /// P(detected | target).
    pub detected: f64,
    /// P(detected | clutter).
    pub false_again: f64,
    /// α.
    pub false_start: f64,
    /// β.
    pub false_drop: f64,
}

impl From<&RatioParams> for RatioTest {
    fn from(p: &RatioParams) -> Self {
        let RatioParams { detected, false_again, false_start, false_drop, .. } = *p;
        Self { detected, false_again, false_start, false_drop }
    }
}

impl RatioTest {
    /// The upper threshold, ln((1 − β) / α).
    pub fn confirmed_at(&self) -> f64 {
        ((1.0 - self.false_drop) / self.false_start).ln()
    }

    /// The lower threshold, ln(β / (1 − α)).
    pub fn refuted_at(&self) -> f64 {
        (self.false_drop / (1.0 - self.false_start)).ln()
    }
}

/// How much speaks for a target: a sum of log-likelihood ratios of *target* against *clutter*, in nats.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub(in crate::many) struct Nats(pub f64);

impl Nats {
    /// A frame in which it was detected with this confidence, or was not: log P(detected | target) − log P(detected | clutter),
    /// or the same of not detected. What speaks against it does not pile up.
    pub fn look(&mut self, confidence: Option<f64>, test: &RatioTest) {
        let missed = ((1.0 - test.detected) / (1.0 - test.false_again)).ln();
        let nats = confidence.map_or(missed, |c| (test.detected * c / test.false_again).ln().max(missed));
        self.0 = (self.0 + nats).max(test.refuted_at());
    }

    /// A frame, and what it says; what speaks against it does not pile up.
    pub fn add(&mut self, nats: f64, test: &RatioTest) {
        self.0 = (self.0 + nats).max(test.refuted_at());
    }

    /// Whether enough speaks for it.
    pub fn confirm(self, test: &RatioTest) -> bool {
        self.0 >= test.confirmed_at()
    }

    /// Whether enough speaks against it.
    pub fn refute(self, test: &RatioTest) -> bool {
        self.0 <= test.refuted_at()
    }
}
