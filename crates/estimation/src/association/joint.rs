//! Joint probabilistic data association (Fortmann, Bar-Shalom, Scheffe, IEEE J. Oceanic Eng. 1983): how likely each
//! detection is of each target, over all ways in which they can be so together. In a cluster with more ways than may be looked
//! at they are approximated by loopy belief propagation (Williams and Lau, IEEE Trans. Aerospace 50, 2014).

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

use super::Distances;
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
        let width = distances.detections() + 1;
        let mut weights = vec![0.0; distances.targets() * width];
        for (target, row) in weights.chunks_exact_mut(width).enumerate() {
            let base = (params.detection_probability / params.clutter_density).ln()
                - 0.5 * (distances.log_determinants[target] + components * std::f64::consts::TAU.ln());
            let logs = (0..distances.detections()).map(|detection| {
                let squared = distances.squared(target, detection);
                let admitted = squared <= params.gate.threshold;
                if admitted { base - 0.5 * (squared + extra(target, detection)) } else { f64::NEG_INFINITY }
            });
            // Every event has one factor of each target, so that these may be scaled: none overflows.
            let highest = logs.clone().fold(missed.ln(), f64::max);
            row[0] = (missed.ln() - highest).exp();
            for (slot, log) in row[1..].iter_mut().zip(logs) {
                *slot = (log - highest).exp();
            }
        }
        let mut found = Marginals { width, taken: vec![false; width], left: 0, values: vec![] };
        found.values.resize(weights.len(), 0.0);
        for cluster in clusters(&weights, width) {
            found.left = params.most_events;
            if found.cluster(&mut weights, &cluster).is_err() {
                found.taken.fill(false);
                found.propagate(&weights, &cluster);
            }
        }
        Ok(Probabilities { values: found.values, width })
    }
}

/// Targets in groups that share no detection with another group.
fn clusters(weights: &[f64], width: usize) -> Vec<Vec<usize>> {
    let targets = weights.len() / width;
    // A forest: every target points to one of its group, the root to itself.
    let mut parent: Vec<usize> = (0..targets).collect();
    for detection in 1..width {
        let mut seen_by = (0..targets).filter(|target| weights[target * width + detection] > 0.0);
        let Some(first) = seen_by.next() else { continue };
        for other in seen_by {
            let (a, b) = (root(&mut parent, first), root(&mut parent, other));
            parent[a.max(b)] = a.min(b);
        }
    }
    let mut groups = vec![Vec::new(); targets];
    for target in 0..targets {
        let of = root(&mut parent, target);
        groups[of].push(target);
    }
    groups.retain(|group| !group.is_empty());
    groups
}

/// The root of a target's group; shortens the way there.
fn root(parent: &mut [usize], mut target: usize) -> usize {
    while parent[target] != target {
        parent[target] = parent[parent[target]];
        target = parent[target];
    }
    target
}

/// The most targets of one cluster: the sum goes as deep.
const LARGEST_CLUSTER: usize = 1000;

/// Sums below this may have lost events to underflow.
const LEAST_TOTAL: f64 = 1e-200;

/// Messages that move by less have settled.
const SETTLED: f64 = 1e-9;

/// They settle geometrically; this bounds the time of what hardly does.
const MOST_ROUNDS: usize = 1000;

/// A chance of being missed below this counts as this much, and a pair as no more likely than that: sums stay finite.
const LEAST_MISSED: f64 = 1e-150;
const MOST_RATIO: f64 = 1e150;

/// Sums over joint events.
struct Marginals {
    width: usize,
    taken: Vec<bool>,
    left: usize,
    values: Vec<f64>,
}

impl Marginals {
    fn cluster(&mut self, weights: &mut [f64], targets: &[usize]) -> Result<()> {
        let too_many = EstimationError::TooMany { what: "targets that share detections" };
        if targets.len() > LARGEST_CLUSTER {
            return Err(too_many);
        }
        let mut total = self.below(weights, targets, 1.0)?;
        if total < LEAST_TOTAL {
            // Many targets and few detections: against "all are missed" nothing vanishes.
            for &target in targets {
                let row = target * self.width..(target + 1) * self.width;
                self.values[row.clone()].fill(0.0);
                let missed = weights[row.start];
                weights[row].iter_mut().for_each(|weight| *weight /= missed);
            }
            total = self.below(weights, targets, 1.0)?;
        }
        if !total.is_finite() {
            return Err(too_many);
        }
        for &target in targets {
            for value in &mut self.values[target * self.width..(target + 1) * self.width] {
                *value /= total;
            }
        }
        Ok(())
    }

    /// The same by messages between targets and detections until they settle.
    fn propagate(&mut self, weights: &[f64], targets: &[usize]) {
        let width = self.width;
        let row = |target: usize| &weights[target * width..(target + 1) * width];
        // Pairs of the cluster: its target's place in it, the detection, and the weight against "missed".
        let ratio = |row: &[f64], choice: usize| (row[choice] / row[0].max(LEAST_MISSED)).min(MOST_RATIO);
        let pairs: Vec<(usize, usize, f64)> = targets
            .iter()
            .enumerate()
            .flat_map(|(at, target)| {
                let row = row(*target);
                (1..width).filter(|c| row[*c] > 0.0).map(move |c| (at, c, ratio(row, c)))
            })
            .collect();
        let mut to_target = vec![1.0; pairs.len()];
        let mut of_target = vec![0.0; targets.len()];
        let mut of_detection = vec![0.0; width];
        let mut to_detection = vec![0.0; pairs.len()];
        for _ in 0..MOST_ROUNDS {
            of_target.fill(0.0);
            of_detection.fill(0.0);
            for ((at, _, ratio), message) in pairs.iter().zip(&to_target) {
                of_target[*at] += ratio * message;
            }
            for (((at, choice, ratio), message), out) in pairs.iter().zip(&to_target).zip(&mut to_detection) {
                *out = ratio / (1.0 + (of_target[*at] - ratio * message).max(0.0));
                of_detection[*choice] += *out;
            }
            let mut moved: f64 = 0.0;
            for (((_, choice, _), message), back) in pairs.iter().zip(&to_detection).zip(&mut to_target) {
                let next = 1.0 / (1.0 + (of_detection[*choice] - message).max(0.0));
                moved = moved.max((next - *back).abs());
                *back = next;
            }
            if moved < SETTLED {
                break;
            }
        }
        of_target.fill(0.0);
        for ((at, _, ratio), message) in pairs.iter().zip(&to_target) {
            of_target[*at] += ratio * message;
        }
        for (at, target) in targets.iter().enumerate() {
            self.values[target * width..(target + 1) * width].fill(0.0);
            self.values[target * width] = 1.0 / (1.0 + of_target[at]);
        }
        for ((at, choice, ratio), message) in pairs.iter().zip(&to_target) {
            self.values[targets[*at] * width + choice] = ratio * message / (1.0 + of_target[*at]);
        }
    }

    /// The weight of all events of `targets`, given what is taken and the weight `above` of that; adds to the marginals.
    fn below(&mut self, weights: &[f64], targets: &[usize], above: f64) -> Result<f64> {
        let Some((&target, rest)) = targets.split_first() else { return Ok(1.0) };
        let mut total = 0.0;
        for choice in 0..self.width {
            let weight = weights[target * self.width + choice];
            if weight == 0.0 || self.taken[choice] {
                continue;
            }
            self.left = self.left.checked_sub(1).ok_or(EstimationError::TooMany { what: "joint events" })?;
            // The first choice is to be missed, which any number of targets may be.
            self.taken[choice] = choice > 0;
            let sum = weight * self.below(weights, rest, above * weight)?;
            self.taken[choice] = false;
            self.values[target * self.width + choice] += above * sum;
            total += sum;
        }
        Ok(total)
    }
}
