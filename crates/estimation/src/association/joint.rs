//! Joint probabilistic data association (Fortmann, Bar-Shalom, Scheffe, IEEE J. Oceanic Eng. 1983): how likely each
//! detection is of each target, over all ways in which they can be so together. In a cluster with more ways than may be looked
//! at they are approximated by loopy belief propagation (Williams and Lau, IEEE Trans. Aerospace 50, 2014).

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

use super::{Distances, Likelihood, SparseJoint};
use crate::consistency::{Gate, chi_square_cumulative};
use crate::error::require;
use crate::{EstimationError, Gaussian, Result};

/// What is known of the detector.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct JointParams {
    /// `P_D`, the probability that a target is detected at all, in (0, 1).
    pub detection_probability: f64,
    /// `λ`, the expected number of false detections per unit of the measured space (per px² for positions). > 0.
    pub clutter_density: f64,
    /// What lies beyond is not of a target.
    pub gate: Gate,
    /// How many partial events may be looked at in one cluster before it is left to belief propagation; a cluster of five targets
    /// that share five detections has about 3000. ≥ 1.
    pub most_events: usize,
}

/// The probabilities of one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Probabilities {
    /// Target by target: missed, then each detection. Each row sums to one.
    values: Vec<f64>,
    width: usize,
}

impl Probabilities {
    /// Of one target: the probability that none of the detections is its own, then of each detection. `None` beyond the last
    /// target.
    pub fn of(&self, target: usize) -> Option<&[f64]> {
        self.values.get(target * self.width..(target + 1) * self.width)
    }
}

/// Computes the probabilities cluster by cluster of targets that share detections: exactly in small clusters, by belief
/// propagation in those with too many events.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "JointParams", into = "JointParams")]
pub struct JointProbabilities {
    params: JointParams,
}

impl From<JointProbabilities> for JointParams {
    fn from(it: JointProbabilities) -> Self {
        it.params
    }
}

impl TryFrom<JointParams> for JointProbabilities {
    type Error = EstimationError;

    fn try_from(params: JointParams) -> Result<Self> {
        Self::new(params)
    }
}

impl JointProbabilities {
    /// An associator.
    ///
    /// # Errors
    /// Where a parameter is out of range.
    pub fn new(params: JointParams) -> Result<Self> {
        let p = params.detection_probability;
        require("detection_probability", p, p > 0.0 && p < 1.0, "in (0, 1)")?;
        require("clutter_density", params.clutter_density, params.clutter_density > 0.0, "positive")?;
        require("the gate's threshold", params.gate.threshold, params.gate.threshold > 0.0, "positive")?;
        require("most_events", params.most_events as f64, params.most_events > 0, "one or more")?;
        Ok(Self { params })
    }

    /// The probabilities of `detections` for targets whose measurements are expected so.
    ///
    /// # Errors
    /// Where a detection is not finite or a covariance is singular.
    pub fn of<const M: usize>(
        &self,
        expected: &[Gaussian<M>],
        detections: &[SVector<f64, M>],
    ) -> Result<Probabilities> {
        let mut distances = Distances::new();
        distances.fill(expected, detections)?;
        self.among(&distances, |_, _| 0.0)
    }

    /// The same of `distances` that were measured before; `extra` is what speaks against a pair inside the gate besides, in the
    /// unit of squared distances (minus twice the logarithm of a likelihood ratio).
    ///
    /// # Errors
    /// Where the gate's probability cannot be computed.
    pub fn among(&self, distances: &Distances, extra: impl Fn(usize, usize) -> f64) -> Result<Probabilities> {
        let params = &self.params;
        let components = distances.components as f64;
        let inside = chi_square_cumulative(components, params.gate.threshold)?;
        let missed = 1.0 - params.detection_probability * inside;
        let mut pairs = Vec::new();
        for target in 0..distances.targets() {
            let base = (params.detection_probability / params.clutter_density / missed).ln()
                - 0.5 * (distances.log_determinants[target] + components * std::f64::consts::TAU.ln());
            for detection in 0..distances.detections() {
                let squared = distances.squared(target, detection);
                let nats = base - 0.5 * (squared + extra(target, detection));
                if squared <= params.gate.threshold && nats > f64::NEG_INFINITY {
                    pairs.push(Likelihood { target, detection, nats });
                }
            }
        }
        let mut joint = SparseJoint::new();
        let found = joint.solve(distances.targets(), distances.detections(), &pairs, params.most_events)?;
        let width = distances.detections() + 1;
        let mut values = vec![0.0; distances.targets() * width];
        for (pair, probability) in pairs.iter().zip(found) {
            values[pair.target * width + 1 + pair.detection] = *probability;
        }
        for (row, missed) in values.chunks_exact_mut(width).zip(joint.missed()) {
            row[0] = *missed;
        }
        Ok(Probabilities { values, width })
    }
}
