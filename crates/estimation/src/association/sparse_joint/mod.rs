//! Joint probabilities where most pairs are impossible: cluster by cluster of targets that share detections.

use super::clusters::Clusters;
use crate::{EstimationError, Result};

/// A target and a detection that may be its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Likelihood {
    /// The target.
    pub target: usize,
    /// The detection.
    pub detection: usize,
    /// Logarithm of how much likelier it is that the detection is the target's own than that the target was missed and the
    /// detection is false, each by itself; finite.
    pub nats: f64,
}

/// The most targets of one cluster whose events are summed up: the sum goes as deep.
const LARGEST_CLUSTER: usize = 1000;

/// Sums below this may have lost events to underflow.
const LEAST_TOTAL: f64 = 1e-200;

/// Messages that move by less have settled.
const SETTLED: f64 = 1e-9;

/// They settle geometrically (Williams and Lau 2014 prove it); these bound the time of what hardly does: rounds, and messages in all of them.
const MOST_ROUNDS: usize = 1000;
const MOST_MESSAGES: usize = 20_000_000;

/// A pair counts as no more likely than so much in nats, so that sums of messages stay finite.
const MOST_NATS: f64 = 345.0;

/// How likely each detection is of each target, over all ways in which they can be so together: exactly in small clusters, by
/// loopy belief propagation (Williams and Lau 2014) in others. Time and memory go with the pairs. Keeps its memory from one
/// problem to the next.
#[derive(Debug, Clone, Default)]
pub struct SparseJoint {
    /// Where the pairs of each target begin; one more, where the last ones end.
    starts: Vec<usize>,
    /// Detection and place in the problem of each pair, target by target.
    pairs: Vec<(usize, usize)>,
    clusters: Clusters,
    /// Root and target, those of a cluster together.
    order: Vec<(usize, usize)>,
    sums: Sums,
    messages: Messages,
    probabilities: Vec<f64>,
    missed: Vec<f64>,
}

impl SparseJoint {
    /// A solver.
    pub fn new() -> Self {
        Self::default()
    }

    /// The probability of each of `pairs`, each of which is given once. A cluster with more than `most_events` partial events is left to belief
    /// propagation; whatever is asked, the probabilities of a target and that it was missed ([`missed`](Self::missed)) sum to one.
    ///
    /// # Errors
    /// Where a pair is of a target or detection that there is not, or its likelihood is not finite; there is then no answer.
    pub fn solve(
        &mut self,
        targets: usize,
        detections: usize,
        pairs: &[Likelihood],
        most_events: usize,
    ) -> Result<&[f64]> {
        self.probabilities.clear();
        self.missed.clear();
        for pair in pairs {
            let places = [("target", pair.target, targets), ("detection", pair.detection, detections)];
            if let Some((what, index, length)) = places.into_iter().find(|(_, index, length)| index >= length) {
                return Err(EstimationError::Index { what, index, length });
            }
            if !pair.nats.is_finite() {
                return Err(EstimationError::NotFinite { what: "the likelihood of a pair" });
            }
        }
        self.prepare(targets, detections, pairs);
        self.sums.start(detections);
        let order = std::mem::take(&mut self.order);
        for cluster in order.chunk_by(|a, b| a.0 == b.0) {
            self.cluster(cluster, pairs, most_events);
        }
        self.order = order;
        Ok(&self.probabilities)
    }

    /// Of each target the probability that none of the detections is its own.
    pub fn missed(&self) -> &[f64] {
        &self.missed
    }

    fn prepare(&mut self, targets: usize, detections: usize, pairs: &[Likelihood]) {
        let starts = &mut self.starts;
        starts.clear();
        starts.resize(targets + 2, 0);
        // Counted two places on, and moved one place on by filling: in the end each target's own start.
        pairs.iter().for_each(|pair| starts[pair.target + 2] += 1);
        for at in 2..starts.len() {
            starts[at] += starts[at - 1];
        }
        self.pairs.clear();
        self.pairs.resize(pairs.len(), (0, 0));
        self.clusters.start(targets + detections);
        for (place, pair) in pairs.iter().enumerate() {
            let at = &mut starts[pair.target + 1];
            self.pairs[*at] = (pair.detection, place);
            *at += 1;
            self.clusters.join(pair.target, targets + pair.detection);
        }
        self.order.clear();
        for target in 0..targets {
            let root = self.clusters.root(target);
            self.order.push((root, target));
        }
        self.order.sort_unstable();
        self.probabilities.resize(pairs.len(), 0.0);
        self.missed.resize(targets, 1.0);
    }

    fn cluster(&mut self, cluster: &[(usize, usize)], pairs: &[Likelihood], most_events: usize) {
        let Self { starts, pairs: own, sums, messages, probabilities, missed, .. } = self;
        if let [(_, target)] = cluster {
            return alone(&own[starts[*target]..starts[*target + 1]], pairs, &mut missed[*target], probabilities);
        }
        sums.fill(cluster, starts, own, pairs);
        let answer = if sums.all_events(most_events) {
            &sums.values
        } else {
            messages.settle(sums, own.len());
            &messages.values
        };
        for (at, (_, target)) in cluster.iter().enumerate() {
            let (from, to) = (sums.rows[at], sums.rows[at + 1]);
            missed[*target] = answer[from];
            let places = own[starts[*target]..starts[*target + 1]].iter().map(|(_, place)| *place);
            places.zip(&answer[from + 1..to]).for_each(|(place, value)| probabilities[place] = *value);
        }
    }
}

/// Of a target that shares nothing with others.
fn alone(own: &[(usize, usize)], pairs: &[Likelihood], missed: &mut f64, probabilities: &mut [f64]) {
    let nats = |place: usize| pairs[place].nats;
    let highest = own.iter().map(|(_, place)| nats(*place)).fold(0.0, f64::max);
    let total = (-highest).exp() + own.iter().map(|(_, place)| (nats(*place) - highest).exp()).sum::<f64>();
    *missed = (-highest).exp() / total;
    own.iter().for_each(|(_, place)| probabilities[*place] = (nats(*place) - highest).exp() / total);
}

/// Sums over the joint events of a cluster.
#[derive(Debug, Clone, Default)]
struct Sums {
    /// Where the choices of each target of the cluster begin, to be missed being the first; one more for the end.
    rows: Vec<usize>,
    /// The detection of each choice; of the first ones none is meant.
    choices: Vec<usize>,
    /// Nats of each choice, and its weight beside the greatest of its target.
    nats: Vec<f64>,
    weights: Vec<f64>,
    /// What events with that choice weigh together; in the end its probability.
    values: Vec<f64>,
    /// Whether each detection is taken.
    taken: Vec<bool>,
    left: usize,
}

impl Sums {
    fn start(&mut self, detections: usize) {
        self.taken.clear();
        self.taken.resize(detections, false);
    }

    fn fill(&mut self, cluster: &[(usize, usize)], starts: &[usize], own: &[(usize, usize)], pairs: &[Likelihood]) {
        self.rows.clear();
        self.choices.clear();
        self.nats.clear();
        for (_, target) in cluster {
            self.rows.push(self.choices.len());
            self.choices.push(usize::MAX);
            self.nats.push(0.0);
            for (detection, place) in &own[starts[*target]..starts[*target + 1]] {
                self.choices.push(*detection);
                self.nats.push(pairs[*place].nats);
            }
        }
        self.rows.push(self.choices.len());
    }

    /// Whether all events could be summed up.
    fn all_events(&mut self, most_events: usize) -> bool {
        let targets = self.rows.len() - 1;
        if targets > LARGEST_CLUSTER {
            return false;
        }
        // Every event has one factor of each target, so that these may be scaled: none overflows.
        self.weigh(|row| row.iter().copied().fold(0.0, f64::max));
        self.left = most_events;
        let mut total = self.below(0, 1.0);
        if total.is_some_and(|total| total < LEAST_TOTAL) {
            // Many targets and few detections: against "all are missed" nothing vanishes.
            self.weigh(|_| 0.0);
            total = self.below(0, 1.0);
        }
        let Some(total) = total.filter(|total| total.is_finite()) else {
            self.choices.iter().for_each(|c| self.taken.get_mut(*c).into_iter().for_each(|taken| *taken = false));
            return false;
        };
        self.values.iter_mut().for_each(|value| *value /= total);
        true
    }

    /// Weights beside `highest` of each target's nats; sums of nothing yet.
    fn weigh(&mut self, highest: impl Fn(&[f64]) -> f64) {
        self.weights.clear();
        for row in self.rows.windows(2) {
            let row = &self.nats[row[0]..row[1]];
            let highest = highest(row);
            self.weights.extend(row.iter().map(|nats| (nats - highest).exp()));
        }
        self.values.clear();
        self.values.resize(self.weights.len(), 0.0);
    }

    /// The weight of all events of the targets from `at` on, given what is taken and the weight `above` of that; adds to the
    /// sums. `None` where there are more than may be looked at.
    fn below(&mut self, at: usize, above: f64) -> Option<f64> {
        if at + 1 == self.rows.len() {
            return Some(1.0);
        }
        let mut total = 0.0;
        for choice in self.rows[at]..self.rows[at + 1] {
            let (weight, detection) = (self.weights[choice], self.choices[choice]);
            // The first choice is to be missed, which any number of targets may be.
            let taken = self.taken.get(detection).copied().unwrap_or(false);
            if weight == 0.0 || taken {
                continue;
            }
            self.left = self.left.checked_sub(1)?;
            self.taken.get_mut(detection).into_iter().for_each(|taken| *taken = true);
            let sum = weight * self.below(at + 1, above * weight)?;
            self.taken.get_mut(detection).into_iter().for_each(|taken| *taken = false);
            self.values[choice] += above * sum;
            total += sum;
        }
        Some(total)
    }
}

/// Messages between targets and detections.
#[derive(Debug, Clone, Default)]
struct Messages {
    /// Of each choice: its weight against "missed", what its target tells its detection, and what that answers.
    ratios: Vec<f64>,
    to_detection: Vec<f64>,
    to_target: Vec<f64>,
    /// What each detection was told in all.
    told: Vec<f64>,
    values: Vec<f64>,
}

impl Messages {
    /// Sends messages until they settle (Williams and Lau 2014, with the ratios of both ways).
    fn settle(&mut self, sums: &Sums, pairs: usize) {
        let Self { ratios, to_detection, to_target, told, values } = self;
        ratios.clear();
        ratios.extend(sums.nats.iter().map(|nats| nats.clamp(-MOST_NATS, MOST_NATS).exp()));
        for messages in [&mut *to_detection, to_target, values] {
            messages.clear();
            messages.resize(ratios.len(), 1.0);
        }
        told.resize(sums.taken.len().max(told.len()), 0.0);
        let choices = || sums.rows.windows(2).flat_map(|row| row[0] + 1..row[1]);
        for _ in 0..MOST_ROUNDS.min(MOST_MESSAGES / pairs.max(1)).max(20) {
            choices().for_each(|choice| told[sums.choices[choice]] = 0.0);
            for row in sums.rows.windows(2) {
                let row = row[0] + 1..row[1];
                let of_target: f64 = row.clone().map(|choice| ratios[choice] * to_target[choice]).sum();
                for choice in row {
                    let others = (of_target - ratios[choice] * to_target[choice]).max(0.0);
                    to_detection[choice] = ratios[choice] / (1.0 + others);
                    told[sums.choices[choice]] += to_detection[choice];
                }
            }
            let mut moved: f64 = 0.0;
            for choice in choices() {
                let next = 1.0 / (1.0 + (told[sums.choices[choice]] - to_detection[choice]).max(0.0));
                moved = moved.max((next - to_target[choice]).abs());
                to_target[choice] = next;
            }
            if moved < SETTLED {
                break;
            }
        }
        for row in sums.rows.windows(2) {
            let own = row[0] + 1..row[1];
            let total = 1.0 + own.clone().map(|choice| ratios[choice] * to_target[choice]).sum::<f64>();
            values[row[0]] = 1.0 / total;
            own.for_each(|choice| values[choice] = ratios[choice] * to_target[choice] / total);
        }
    }
}

#[cfg(test)]
mod tests;
