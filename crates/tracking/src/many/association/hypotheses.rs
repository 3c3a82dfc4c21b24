//! Track-oriented multiple hypothesis tracking (Kurien 1990; Blackman 2004): what cannot be decided in one frame is decided some
//! frames later.
//!
//! Every target is a tree of branches. In each frame a branch goes on with every detection near it and with none; its score is the
//! sum of the log-likelihood ratios that [`NearestParams`] weigh for one frame. The best global hypothesis, one branch of each target and
//! no detection twice, is what is reported; branches that contradict what it says of the frame `n_scan` frames ago are given up.

use super::nearest::{Alone, Price};
use super::{Claimant, Given, Pairs};
use crate::many::branches::{MOST_DETECTIONS, MOST_SCANS, Past};
use pursuit_estimation::EstimationError;
use pursuit_estimation::association::{GlobalHypothesis, Pairing, SparseAssignment};

pursuit_parameters::parameters! {
    /// Multiple hypothesis tracking: the price of a pair is that of `nearest`, but who is given what may be decided some frames
    /// later. What is reported is the best hypothesis so far; a whole clip at once is corrected afterwards.
    pub struct HypothesesParams {
        /// N: by so many frames a decision is put off at most; 0: not at all, as `nearest`.
        pub n_scan: usize = 3, in 0..=8, unit "frames", source "blackman2004";
        /// Branches kept of a target.
        pub branches: usize = 12, in 1..=64, source "ours";
        /// A branch that scores less than the one chosen by more than this is given up.
        pub within: f64 = 20.0, in 0.0.., unit "nats", source "ours";
        /// Branches looked at in a cluster of targets that share detections, until the best hypothesis so far is improved by exchanges alone.
        pub most_nodes: usize = 10_000, in 0..=100_000_000, source "ours";
    }
}

/// How a branch goes on in this frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::many) struct Next {
    /// The branch before: 0 is the one reported, k the one at the place k − 1 of the others.
    pub parent: usize,
    /// What it takes; `None`: it is missed.
    pub detection: Option<usize>,
    /// What it has taken up to now, this frame not yet counted.
    before: Past,
    /// Its score, this frame counted.
    nats: f64,
}

impl Next {
    /// What it has taken, this frame counted.
    fn past(&self, from_nats: f64, scans: usize) -> Past {
        self.before.after(self.detection, scans).scored(self.nats - from_nats)
    }
}

/// The branches that go on of one target, the one reported first.
#[derive(Debug, Clone, Copy)]
pub(in crate::many) struct GoesOn<'a> {
    pub branches: &'a [(Next, Past)],
    /// Whether it is a candidate that the best hypothesis knows nothing of.
    pub refuted: bool,
}

/// Keeps its memory from one frame to the next.
#[derive(Default)]
pub(super) struct Hypotheses {
    alone: Alone,
    /// Of each branch that claims detections, which target it is a branch of, and which branch.
    of: Vec<(usize, usize)>,
    pairings: Vec<Pairing>,
    assignment: SparseAssignment,
    /// How branches may go on, target by target, the one that is possible for sure first; and where those of each target begin.
    children: Vec<Next>,
    starts: Vec<usize>,
    best: GlobalHypothesis,
    first: Vec<usize>,
    /// Those kept, and where those of each target begin.
    kept: Vec<(Next, Past)>,
    kept_from: Vec<usize>,
    refuted: Vec<bool>,
}

impl Hypotheses {
    /// Every branch of every target as one that claims detections.
    pub fn branches<'a>(&mut self, targets: &[Claimant<'a>], all: &mut Vec<Claimant<'a>>) {
        self.of.clear();
        for (target, own) in targets.iter().enumerate() {
            all.push(*own);
            self.of.push((target, 0));
            for (other, branch) in own.branches.others.iter().enumerate() {
                if let Some((_, expectation)) = &branch.expected {
                    all.push(Claimant { expectation, unseen_s: branch.unseen.seconds, ..*own });
                    self.of.push((target, other + 1));
                }
            }
        }
    }

    /// Gives detections to targets; the pairs are of [`branches`](Self::branches).
    ///
    /// # Errors
    /// Where there are more detections than branches can tell apart.
    pub fn associate(&mut self, pairs: &Pairs<'_>, given: &mut Given) -> Result<(), EstimationError> {
        if pairs.detections.len() > MOST_DETECTIONS {
            return Err(EstimationError::TooMany { what: "detections in one frame" });
        }
        self.branch(pairs)?;
        self.choose(pairs)?;
        self.prune(pairs);
        for target in 0..pairs.targets.len() {
            let chosen = self.kept.get(self.kept_from[target]).filter(|_| !self.refuted[target]);
            if let Some(detection) = chosen.and_then(|(next, _)| next.detection) {
                given.give(target, detection);
            }
        }
        self.give_alone(pairs, given);
        Ok(())
    }

    /// How the branches of a target go on.
    pub fn goes_on(&self, target: usize) -> Option<GoesOn<'_>> {
        let (from, to) = (*self.kept_from.get(target)?, *self.kept_from.get(target + 1)?);
        Some(GoesOn { branches: self.kept.get(from..to)?, refuted: *self.refuted.get(target)? })
    }

    /// How every branch of every target may go on.
    fn branch(&mut self, pairs: &Pairs<'_>) -> Result<(), EstimationError> {
        let params = &pairs.params.hypotheses;
        let price = Price::new(&pairs.params.nearest);
        // What is possible for sure: the branches reported go on with what is best for them together.
        self.pairings.clear();
        for pair in pairs.near {
            let (target, branch) = self.of[pair.target];
            let nats = price.nats(pair, pairs.detections);
            if branch == 0 {
                self.pairings.push(Pairing { row: target, column: pair.detection, cost: -nats });
            }
        }
        let sure = self.assignment.solve(pairs.targets.len(), pairs.detections.len(), &self.pairings)?;
        self.children.clear();
        self.starts.clear();
        let mut near = pairs.near.iter().peekable();
        for (at, &(target, parent)) in self.of.iter().enumerate() {
            let branches = pairs.targets[target].branches;
            let before = parent.checked_sub(1).map_or(branches.own, |other| branches.others[other].past);
            if parent == 0 {
                close(&mut self.children, &self.starts, params);
                self.starts.push(self.children.len());
                // Its place is that of the first.
                self.children.push(Next { parent, detection: None, before, nats: before.nats });
            }
            let missed = Next { parent, detection: None, before, nats: before.nats };
            let sure = sure[target].filter(|_| parent == 0);
            if parent > 0 || sure.is_some() {
                self.children.push(missed);
            }
            while let Some(pair) = near.next_if(|pair| pair.target == at) {
                let nats = price.nats(pair, pairs.detections);
                let next = Next { detection: Some(pair.detection), nats: before.nats + nats, ..missed };
                if sure == Some(pair.detection) {
                    self.children[self.starts[target]] = next;
                } else if nats > -params.within {
                    self.children.push(next);
                }
            }
        }
        close(&mut self.children, &self.starts, params);
        self.starts.push(self.children.len());
        Ok(())
    }

    /// The best global hypothesis.
    fn choose(&mut self, pairs: &Pairs<'_>) -> Result<(), EstimationError> {
        // Detections of the frames before are numbered behind those of this one.
        let mut offsets = [0; MOST_SCANS + 1];
        for child in &self.children {
            for (ago, detection) in child.before.all() {
                offsets[ago + 1] = offsets[ago + 1].max(detection + 1);
            }
        }
        let (mut all, scans) = (pairs.detections.len(), pairs.params.hypotheses.n_scan);
        for offset in offsets.iter_mut().skip(1) {
            (*offset, all) = (all, all + *offset);
        }
        self.best.clear(all);
        self.first.clear();
        for (target, claimant) in pairs.targets.iter().enumerate() {
            self.best.track();
            for child in &self.children[self.starts[target]..self.starts[target + 1]] {
                let older = child.before.all().filter(|(ago, _)| *ago < scans).map(|(ago, d)| offsets[ago + 1] + d);
                self.best.branch(child.nats, child.detection.into_iter().chain(older));
            }
            if !claimant.confirmed {
                // A candidate may be nothing.
                self.best.branch(0.0, []);
            }
            self.first.push(0);
        }
        match self.best.solve(&self.first, pairs.params.hypotheses.most_nodes) {
            Ok(chosen) => self.first.copy_from_slice(chosen),
            // Two of those reported had one detection, as a state from elsewhere may say: what they took before is forgotten.
            Err(EstimationError::Incompatible { .. }) => {
                for target in 0..pairs.targets.len() {
                    let (from, to) = (self.starts[target], self.starts[target + 1]);
                    self.children[from..to].iter_mut().for_each(|child| child.before = Past::default());
                }
            }
            Err(other) => return Err(other),
        }
        Ok(())
    }

    /// Keeps of each target the branch chosen and those that agree with it about what was N frames ago and score nearly as much.
    fn prune(&mut self, pairs: &Pairs<'_>) {
        let params = &pairs.params.hypotheses;
        let scans = params.n_scan;
        self.kept.clear();
        self.kept_from.clear();
        self.refuted.clear();
        for (target, claimant) in pairs.targets.iter().enumerate() {
            self.kept_from.push(self.kept.len());
            let own = &self.children[self.starts[target]..self.starts[target + 1]];
            self.refuted.push(self.first[target] >= own.len());
            let Some(chosen) = own.get(self.first[target]) else { continue };
            let oldest = |next: &Next| match scans.checked_sub(1) {
                None => next.detection,
                Some(ago) => next.before.taken(ago),
            };
            let from_nats = if claimant.confirmed { chosen.nats } else { 0.0 };
            let first = self.kept.len();
            self.kept.push((*chosen, chosen.past(from_nats, scans)));
            for (at, next) in own.iter().enumerate() {
                let agrees = scans > 0 && oldest(next) == oldest(chosen);
                if at != self.first[target] && agrees && next.nats >= chosen.nats - params.within {
                    self.kept.push((*next, next.past(from_nats, scans)));
                }
            }
            let others = &mut self.kept[first + 1..];
            others.sort_unstable_by(|a, b| b.0.nats.total_cmp(&a.0.nats).then(order(&a.0).cmp(&order(&b.0))));
            self.kept.truncate(first + params.branches);
        }
        self.kept_from.push(self.kept.len());
    }

    /// What is left goes to targets that are alone with it; they have no other branches then.
    fn give_alone(&mut self, pairs: &Pairs<'_>, given: &mut Given) {
        self.alone.give(pairs, given);
        for target in 0..pairs.targets.len() {
            let Some((next, past)) = self.kept.get_mut(self.kept_from[target]) else { continue };
            let (None, [(detection, _)]) = (next.detection, given.shares[target].as_slice()) else { continue };
            next.detection = Some(*detection);
            *past = next.past(next.nats, pairs.params.hypotheses.n_scan);
        }
    }
}

/// Of branches that score alike, the order.
fn order(next: &Next) -> (usize, Option<usize>) {
    (next.parent, next.detection)
}

/// Keeps the best of the last target's children, and the first of them, which is possible for sure.
fn close(children: &mut Vec<Next>, starts: &[usize], params: &HypothesesParams) {
    /// Children looked at for each branch that is kept.
    const PER_BRANCH: usize = 4;
    let Some(first) = starts.last() else { return };
    let most = PER_BRANCH * params.branches;
    if children.len() > first + 1 + most {
        children[first + 1..].sort_unstable_by(|a, b| b.nats.total_cmp(&a.nats).then(order(a).cmp(&order(b))));
        children.truncate(first + 1 + most);
    }
}

#[cfg(test)]
#[path = "hypotheses_tests.rs"]
mod tests;
