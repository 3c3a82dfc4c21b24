//! Global nearest neighbours: the one assignment of detections to targets that is most likely as a whole.

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

use super::{Assignment, Distances};
use crate::consistency::Gate;
use crate::error::require;
use crate::{Gaussian, Result};

/// What an assignment costs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Cost {
    /// The distance squared `νᵀ S⁻¹ ν`; a target without a detection costs as much as the gate, so that every target whose
    /// gate holds a detection of its own gets one. A target that is little known has short distances, and takes detections
    /// from those that are known well.
    Distance,
    /// The negative logarithm of the likelihood, against that of clutter (Blackman and Popoli 1999, 6.4): a detection costs
    /// `−ln(P_D N(ν; 0, S) / λ)` and a target without one `−ln(1 − P_D)`.
    Likelihood {
        /// `P_D`, the probability that a target is detected at all, in (0, 1).
        detection_probability: f64,
        /// `λ`, the expected number of false detections per unit of the measured space (per px² for positions). > 0.
        clutter_density: f64,
    },
}

/// Assigns detections to targets, all at once. Keeps its memory from one frame to the next.
#[derive(Debug, Clone)]
pub struct NearestNeighbours {
    gate: Gate,
    cost: Cost,
    distances: Distances,
    assignment: Assignment,
}

impl NearestNeighbours {
    /// An associator that never pairs what `gate` does not admit.
    ///
    /// # Errors
    /// Where the gate's threshold is not positive and finite, or a parameter of the cost is out of range.
    pub fn new(gate: Gate, cost: Cost) -> Result<Self> {
        require("the gate's threshold", gate.threshold, gate.threshold > 0.0, "positive")?;
        if let Cost::Likelihood { detection_probability: p, clutter_density } = cost {
            require("detection_probability", p, p > 0.0 && p < 1.0, "in (0, 1)")?;
            require("clutter_density", clutter_density, clutter_density > 0.0, "positive")?;
        }
        Ok(Self { gate, cost, distances: Distances::new(), assignment: Assignment::new() })
    }

    /// The detection of each target, `None` where it has none. See [`super::unmatched`] for detections that nobody got.
    ///
    /// # Errors
    /// Where a detection is not finite or the covariance of an expected measurement is singular.
    pub fn associate<const M: usize>(
        &mut self,
        expected: &[Gaussian<M>],
        detections: &[SVector<f64, M>],
    ) -> Result<&[Option<usize>]> {
        let Self { gate, cost, distances, assignment } = self;
        distances.fill(expected, detections)?;
        let squared = |target: usize, detection: usize| distances.squared[target * detections.len() + detection];
        let admitted = |target, detection| squared(target, detection) <= gate.threshold;
        match *cost {
            Cost::Distance => assignment.solve(
                expected.len(),
                detections.len(),
                |t, d| if admitted(t, d) { squared(t, d) } else { f64::INFINITY },
                |_| gate.threshold,
            ),
            Cost::Likelihood { detection_probability, clutter_density } => {
                let base = (clutter_density / detection_probability).ln() + 0.5 * M as f64 * std::f64::consts::TAU.ln();
                let likely = |t: usize, d| base + 0.5 * (squared(t, d) + distances.log_determinants[t]);
                assignment.solve(
                    expected.len(),
                    detections.len(),
                    |t, d| if admitted(t, d) { likely(t, d) } else { f64::INFINITY },
                    |_| -(-detection_probability).ln_1p(),
                )
            }
        }
    }
}
