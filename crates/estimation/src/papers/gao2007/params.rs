//! Constants of `gao2007`, and of the gated form that replaces its printed one.

use serde::{Deserialize, Serialize};

use crate::error::require;
use crate::regression::Kernel;
use crate::{EstimationError, Result};

/// How the acceleration that disturbs the gated filter goes on within a step. With a measurement that is believed nearly as it is the
/// difference is large: an acceleration that is held puts every innovation twice into the velocity, which then swings about the target's.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum AccelerationNoise {
    /// Constant over a step: `Q = q [[T⁴/4, T³/2], [T³/2, T²]]`, as printed.
    #[default]
    Held,
    /// White: `Q = q [[T³/3, T²/2], [T²/2, T]]`.
    White,
}

/// Parameters of the gated, division-free filter. The paper prints no values: these were chosen on synthetic benches and
/// checked on fresh seeds (see the paper's page).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct GatedParams {
    /// `q`, variance of the acceleration that is constant over a step, (units/s²)²; of white noise its spectral density, units²/s³. ≥ 0.
    pub acceleration_variance: f64,
    /// Which of both it is.
    pub noise: AccelerationNoise,
    /// `R`, variance of the measured position, units². > 0.
    pub measurement_variance: f64,
    /// `N`, how many velocities are regressed on time. 2 to 64.
    pub samples: usize,
    /// `γ` of the regression. > 0.
    pub gamma: f64,
    /// Kernel of the regression, on time in steps.
    pub kernel: Kernel,
    /// `W`, over how many updates the normalised innovation squared is averaged to detect a manoeuvre. 1 to 64.
    pub window: usize,
    /// The gate opens where that average exceeds this; 1 is expected without a manoeuvre. > 0.
    pub threshold: f64,
    /// For how many steps the gate stays open once opened. ≥ 1.
    pub hold: usize,
    /// The gate opens only where the regression has predicted the last measurements better than the filter without it: the share of a new
    /// squared error in the means that are compared, in `[0, 1]`. 0: it opens all the same.
    pub guard: f64,
}

impl GatedParams {
    /// The recommended form, `N = 5`, `γ = 1`, linear kernel, mean of 3 NIS above 3, hold 1, with the given noise.
    pub const fn recommended(acceleration_variance: f64, measurement_variance: f64) -> Self {
        Self {
            acceleration_variance,
            noise: AccelerationNoise::Held,
            measurement_variance,
            samples: 5,
            gamma: 1.0,
            kernel: Kernel::Linear,
            window: 3,
            threshold: 3.0,
            hold: 1,
            guard: 0.0,
        }
    }

    pub(super) fn validate(&self) -> Result<()> {
        count("samples", self.samples, 2)?;
        count("window", self.window, 1)?;
        require("threshold", self.threshold, self.threshold > 0.0, "positive")?;
        require("guard", self.guard, (0.0..=1.0).contains(&self.guard), "between 0 and 1")?;
        require("hold", self.hold as f64, self.hold > 0, "one or more")
    }
}

/// The most samples and the longest window: what is kept is kept in place.
pub(super) const MOST: usize = 64;

fn count(what: &'static str, got: usize, least: usize) -> Result<()> {
    if (least..=MOST).contains(&got) {
        Ok(())
    } else {
        Err(EstimationError::Length { what, got, expected: got.clamp(least, MOST) })
    }
}

/// Where the velocities come from whose ratios equation (14) regresses; the paper does not say.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum VelocityReading {
    /// The filter's own velocity after the update. Feeds back into itself: numerically chaotic without a guard.
    Posterior,
    /// Differences of measured positions.
    MeasuredDifference,
    /// Differences of filtered positions.
    FilteredDifference,
}

/// What to do about ratios of velocities, which explode where a velocity passes through zero.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum RatioGuard {
    /// Nothing, as printed. A ratio that is not finite (0/0) still counts as 1.
    None,
    /// Ratios and their prediction are limited to `low..=high`.
    Clamp {
        /// Smallest ratio.
        low: f64,
        /// Largest ratio.
        high: f64,
    },
}

impl RatioGuard {
    /// The ratio, guarded.
    pub(super) fn apply(self, ratio: f64) -> f64 {
        match self {
            _ if !ratio.is_finite() => 1.0,
            Self::None => ratio,
            Self::Clamp { low, high } => ratio.max(low).min(high),
        }
    }
}

/// Parameters of the paper's printed filter, equations (9) to (14).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LiteralParams {
    /// `q`, variance of the acceleration that is constant over a step, (units/s²)². ≥ 0.
    pub acceleration_variance: f64,
    /// `R`, variance of the measured position, units². > 0.
    pub measurement_variance: f64,
    /// `N`, how many ratios are regressed on time. 2 to 64.
    pub samples: usize,
    /// `γ` of the regression, equation (7). > 0.
    pub gamma: f64,
    /// Kernel of the regression, on time in steps.
    pub kernel: Kernel,
    /// Where velocities come from.
    pub velocity: VelocityReading,
    /// What to do about exploding ratios.
    pub guard: RatioGuard,
}

impl LiteralParams {
    /// The configuration that comes nearest to the paper's second and third experiment (setup B of the project's
    /// analysis): filtered differences, `N = 2`, `γ = 31.5`, RBF `σ² = 50.3`, ratios in [.5, 4.22]. There
    /// `q / R = .01165`.
    pub const fn experiment_2(acceleration_variance: f64, measurement_variance: f64) -> Self {
        Self {
            acceleration_variance,
            measurement_variance,
            samples: 2,
            gamma: 31.5,
            kernel: Kernel::Rbf { sigma2: 50.3 },
            velocity: VelocityReading::FilteredDifference,
            guard: RatioGuard::Clamp { low: 0.5, high: 4.22 },
        }
    }

    pub(super) fn validate(&self) -> Result<()> {
        count("samples", self.samples, 2)?;
        if let RatioGuard::Clamp { low, high } = self.guard {
            require("low", low, true, "finite")?;
            require("high", high, high >= low, "no less than low")?;
        }
        Ok(())
    }
}
