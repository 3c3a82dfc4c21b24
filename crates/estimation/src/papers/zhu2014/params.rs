//! Constants of `zhu2014` (patent CN 104574439 A).

use serde::{Deserialize, Serialize};

use crate::Result;
use crate::error::require;

/// How the interval of a detected manoeuvre is gone over again: readings of the patent's equation (6), which splits it
/// in halves.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum HalfInterval {
    /// Two half steps, `A(dt/2) A(dt/2)`, with half the process noise in each. Changes next to nothing: the product is
    /// `A(dt)` exactly.
    HalfNoise,
    /// The same with the whole process noise in each half, as the patent prints `Q` twice. Worse while nothing happens.
    FullNoise,
    /// The literal reading that has an effect: in the second half the target moves with the observed velocity
    /// `(z − x) / dt`; the covariance is that of the plain prediction.
    ObservedVelocity,
    /// A velocity jump of unknown size exactly half-way.
    JumpAtMiddle {
        /// The size's spread.
        jump: Jump,
    },
    /// A velocity jump of unknown size at an unknown instant, uniform over the interval. The default.
    JumpAnywhere {
        /// The size's spread.
        jump: Jump,
    },
}

/// How large a velocity jump may be: normal with deviation `max(least, fraction · speed)` per axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Jump {
    /// Smallest deviation, px/s. > 0.
    pub least_px_per_s: f64,
    /// Deviation as a fraction of the current speed. ≥ 0.
    pub speed_fraction: f64,
}

impl Jump {
    /// The default at one frame per time unit: `max(5 px/frame, half the speed)`, for frames of `frame_s` seconds.
    pub const fn default_for(frame_s: f64) -> Self {
        Self { least_px_per_s: 5.0 / frame_s, speed_fraction: 0.5 }
    }

    /// A deviation that does not depend on the speed, px/s.
    pub const fn fixed(deviation_px_per_s: f64) -> Self {
        Self { least_px_per_s: deviation_px_per_s, speed_fraction: 0.0 }
    }
}

/// Parameters of the filter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Zhu2014Params {
    /// Diagonal of `Q`, equation (5), added at each step: px² for positions and (px/s)² for velocities. The patent: 1.
    pub process_variance: f64,
    /// Diagonal of `R`, equation (4), px². The patent: 1.
    pub measurement_variance_px2: f64,
    /// Normalised innovation squared above which the interval is taken to hold a manoeuvre. > 0; 5.99 is 95 % and 9.21
    /// is 99 % of two components.
    pub threshold: f64,
    /// What is then done.
    pub half_interval: HalfInterval,
}

impl Zhu2014Params {
    /// The default: printed noise (`Q = I₄`, `R = I₂`, one frame per time unit), a jump anywhere, threshold 5.99.
    pub const fn jump_anywhere() -> Self {
        Self {
            process_variance: 1.0,
            measurement_variance_px2: 1.0,
            threshold: 5.99,
            half_interval: HalfInterval::JumpAnywhere { jump: Jump::default_for(1.0) },
        }
    }

    /// The literal reading, threshold 9.21.
    pub const fn literal() -> Self {
        Self { threshold: 9.21, half_interval: HalfInterval::ObservedVelocity, ..Self::jump_anywhere() }
    }

    pub(super) fn validate(&self) -> Result<()> {
        require("process_variance", self.process_variance, self.process_variance >= 0.0, "zero or more")?;
        require("threshold", self.threshold, self.threshold > 0.0, "positive")?;
        if let HalfInterval::JumpAtMiddle { jump } | HalfInterval::JumpAnywhere { jump } = self.half_interval {
            require("least_px_per_s", jump.least_px_per_s, jump.least_px_per_s > 0.0, "positive")?;
            require("speed_fraction", jump.speed_fraction, jump.speed_fraction >= 0.0, "zero or more")?;
        }
        Ok(())
    }
}
