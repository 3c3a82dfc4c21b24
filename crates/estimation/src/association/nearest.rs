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
    /// As many pairs as the gate allows; of all ways to make them the most likely one (`νᵀ S⁻¹ ν + ln det S`).
    MostPairs,
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
        self.distances.fill(expected, detections)?;
        assign(&mut self.assignment, self.gate, self.cost, &self.distances, |_, _| 0.0)
    }

    /// The same of `distances` that were measured before; `extra` is what a pair inside the gate costs besides.
    ///
    /// # Errors
    /// Where a distance or an extra cost is not a number.
    pub fn assign(&mut self, distances: &Distances, extra: impl Fn(usize, usize) -> f64) -> Result<&[Option<usize>]> {
        assign(&mut self.assignment, self.gate, self.cost, distances, extra)
    }
}

fn assign<'a>(
    assignment: &'a mut Assignment,
    gate: Gate,
    cost: Cost,
    distances: &Distances,
    extra: impl Fn(usize, usize) -> f64,
) -> Result<&'a [Option<usize>]> {
    let (targets, detections) = (distances.targets(), distances.detections());
    let squared = |t, d| Some(distances.squared(t, d)).filter(|s| *s <= gate.threshold);
    let unlikely = |t: usize, d| squared(t, d).map(|s| s + distances.log_determinants[t] + extra(t, d));
    match cost {
        Cost::Distance => {
            let cost = |t, d| squared(t, d).map_or(f64::INFINITY, |s| s + extra(t, d));
            assignment.solve(targets, detections, cost, |_| gate.threshold)
        }
        Cost::MostPairs => {
            let pairs = (0..targets).flat_map(|t| (0..detections).map(move |d| (t, d)));
            let range = pairs.filter_map(|(t, d)| unlikely(t, d)).fold(0.0, |most, cost: f64| cost.abs().max(most));
            // To leave one target out costs more than any number of pairs.
            let alone = (2.0 * range + 1.0) * (targets + 1) as f64;
            assignment.solve(targets, detections, |t, d| unlikely(t, d).unwrap_or(f64::INFINITY), |_| alone)
        }
        Cost::Likelihood { detection_probability, clutter_density } => {
            let clutter = (clutter_density / detection_probability).ln();
            let base = clutter + 0.5 * distances.components as f64 * std::f64::consts::TAU.ln();
            let cost = |t, d| unlikely(t, d).map_or(f64::INFINITY, |u| base + 0.5 * u);
            assignment.solve(targets, detections, cost, |_| -(-detection_probability).ln_1p())
        }
    }
}
