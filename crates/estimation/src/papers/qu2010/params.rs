//! Constants of `qu2010`.

use serde::{Deserialize, Serialize};

use crate::motion::ConstantAcceleration;
use crate::{LinearMeasurement, Result};

/// The constant-acceleration filter of section 4: state `[x, y, vx, vy, ax, ay]`, measured `[x, y]`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Qu2010Params {
    /// `Q = q I₆`, added at each step. The paper: .3, with one frame per time unit.
    pub process_variance: f64,
    /// `R = r I₂`, px². The paper: 2.
    pub measurement_variance_px2: f64,
}

impl Qu2010Params {
    /// The printed values, `Q = .3 I`, `R = 2 I`.
    ///
    /// With these the **one-step prediction is worse than the measurement** (root mean square ratio 1.93 on the paper's own
    /// model, 1.49 on motion without noise); only the filtered value is better (.88 and .85).
    pub const fn printed() -> Self {
        Self { process_variance: 0.3, measurement_variance_px2: 2.0 }
    }

    /// The motion model, equation (6).
    pub const fn motion(&self) -> ConstantAcceleration<2> {
        ConstantAcceleration::per_step(self.process_variance)
    }

    /// The sensor, equation (7) with `H = [I₂ 0]`.
    ///
    /// # Errors
    /// Where the variance is negative or not finite.
    pub fn measurement(&self) -> Result<LinearMeasurement<2, 6>> {
        let variance = self.measurement_variance_px2;
        LinearMeasurement::select([0, 1], [variance, variance])
    }
}

/// How many past positions the simplified predictor of section 5 uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Points {
    /// Two: `2 z₁ − z₀` at equal steps. What the paper's Table 1 agrees with; the default.
    #[default]
    Two,
    /// Three: `3 z₂ − 3 z₁ + z₀` at equal steps. Follows acceleration, and triples the noise.
    Three,
}
