//! Constants of the variance recursion of `zhai2024`.

use serde::{Deserialize, Serialize};

use crate::error::require;
use crate::{EstimationError, Result};

/// How the motion noise is estimated from residuals, equations (24) and (25).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum VarianceRule {
    /// `s_k = (k−1)/k s_{k−1} + r_k²/k`: the recursion that does equal the batch estimate (24). Forgets nothing.
    Corrected,
    /// `s_k = (k−1)/k (s_{k−1} + r_k²)` as printed in (25). **Diverges**: its expectation is `σ² (k − 1)/2`.
    Printed,
    /// `s_k = (1 − β) s_{k−1} + β r_k²`, started by the first residual.
    Exponential {
        /// `β`, in (0, 1].
        weight: f64,
    },
    /// The mean of the last residuals squared.
    Window {
        /// How many, 1 to 64.
        length: usize,
    },
}

/// The longest window: what is kept is kept in place.
pub(super) const LONGEST: usize = 64;

/// Parameters of the estimate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct VarianceParams {
    /// The rule.
    pub rule: VarianceRule,
    /// Smallest variance reported, units². ≥ 0. Particles that never move cannot find anything.
    pub floor: f64,
    /// Largest variance reported, units². ≥ `floor`.
    pub cap: f64,
}

impl VarianceParams {
    /// The rule alone, without floor or cap.
    pub const fn unbounded(rule: VarianceRule) -> Self {
        Self { rule, floor: 0.0, cap: f64::MAX }
    }

    /// What the tracker uses: a window of ten frames, a floor of 1 px and a cap of half the target's size, as standard
    /// deviations.
    pub fn for_target(size_px: f64) -> Self {
        let half = (0.5 * size_px).max(1.0);
        Self { rule: VarianceRule::Window { length: 10 }, floor: 1.0, cap: half * half }
    }

    pub(super) fn validate(&self) -> Result<()> {
        require("floor", self.floor, self.floor >= 0.0, "zero or more")?;
        require("cap", self.cap, self.cap >= self.floor, "no less than the floor")?;
        match self.rule {
            VarianceRule::Exponential { weight } => {
                require("weight", weight, weight > 0.0 && weight <= 1.0, "in (0, 1]")
            }
            VarianceRule::Window { length } if !(1..=LONGEST).contains(&length) => Err(EstimationError::Length {
                what: "the window of the variance estimate",
                got: length,
                expected: length.clamp(1, LONGEST),
            }),
            VarianceRule::Corrected | VarianceRule::Printed | VarianceRule::Window { .. } => Ok(()),
        }
    }
}
