//! `qu2010`: a constant-acceleration Kalman predictor for a walking person ([`Qu2010Params`] builds it from the crate's
//! own parts), and the "no noise" simplification of section 5, which is extrapolation.
//!
//! The limits `Q → 0` and `R → 0` do not commute. `R = 0` with noise on the velocity alone is extrapolation from two
//! points; with `Q = 0` instead the gains vanish and nothing that turns is followed. The named mode is the former.

mod params;

pub use params::{Points, Qu2010Params};

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

use crate::matrix::require_finite;
use crate::{EstimationError, Result};

/// Extrapolation of a position from the last two or three, exact for any spacing in time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(remote = "Extrapolator")]
pub struct Extrapolator {
    points: Points,
    /// Times and positions, the latest first.
    seen: [Option<(f64, SVector<f64, 2>)>; 3],
}

crate::checked!(Extrapolator);

impl Extrapolator {
    // What was seen is observed again.
    fn restored(self) -> Result<Self> {
        let mut it = Self::new(self.points);
        for (time_s, position_px) in self.seen.iter().rev().flatten() {
            it.observe(*time_s, position_px)?;
        }
        Ok(it)
    }
}

impl Extrapolator {
    /// An extrapolator that has seen nothing yet.
    pub const fn new(points: Points) -> Self {
        Self { points, seen: [None; 3] }
    }

    /// Takes in a position measured at `time_s`. A missing measurement is no call.
    ///
    /// # Errors
    /// Where a number is not finite or time did not advance; nothing is taken in then.
    pub fn observe(&mut self, time_s: f64, position_px: &SVector<f64, 2>) -> Result<()> {
        require_finite("the measurement", position_px)?;
        let dt_s = self.seen[0].map_or(1.0, |(last_s, _)| time_s - last_s);
        if !(dt_s > 0.0 && time_s.is_finite()) {
            return Err(EstimationError::TimeStep { dt_s });
        }
        self.seen = [Some((time_s, *position_px)), self.seen[0], self.seen[1]];
        Ok(())
    }

    /// The position expected at `time_s`: the polynomial through the last points (Lagrange's form). `None` until there
    /// are enough of them.
    pub fn predict(&self, time_s: f64) -> Option<SVector<f64, 2>> {
        let count = match self.points {
            Points::Two => 2,
            Points::Three => 3,
        };
        let used = &self.seen[..count];
        let mut sum = SVector::zeros();
        for (i, point) in used.iter().enumerate() {
            let (own_s, position) = (*point)?;
            let mut weight = 1.0;
            for (j, other) in used.iter().enumerate() {
                let (other_s, _) = (*other)?;
                if i != j {
                    weight *= (time_s - other_s) / (own_s - other_s);
                }
            }
            sum += position * weight;
        }
        Some(sum)
    }
}
