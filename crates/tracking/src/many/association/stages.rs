//! Assignment stage by stage: what one stage has left takes part in the next.

use super::near::Pair;
use super::{Given, Pairs};
use pursuit_estimation::EstimationError;
use pursuit_estimation::association::{Pairing, SparseAssignment};

/// How alike a target and a detection are in a stage.
#[derive(Debug, Clone, Copy)]
pub(super) struct Alike {
    /// Above 0 for a pair that may be.
    pub likeness: f64,
    /// From this likeness on they are a pair.
    pub least: f64,
    /// Whether a pair that is less alike takes part in the assignment and is thrown out after it.
    pub late: bool,
}

impl Alike {
    /// Whether the pair takes part in the assignment.
    fn takes_part(&self) -> bool {
        self.likeness > 0.0 && (self.late || self.likeness >= self.least)
    }

    /// Whether it is a pair once it was assigned.
    fn is_pair(&self) -> bool {
        self.likeness >= self.least
    }
}

/// Keeps its memory from one frame to the next.
#[derive(Default)]
pub(super) struct Stages {
    pairings: Vec<Pairing>,
    /// Whether each pairing is a pair once it was assigned.
    good: Vec<bool>,
    assignment: SparseAssignment,
}

impl Stages {
    /// Pairs what nobody has yet so that likenesses sum up to the most; `None` for a pair that may not be.
    ///
    /// # Errors
    /// Where a likeness is no number.
    pub fn stage(
        &mut self,
        pairs: &Pairs<'_>,
        given: &mut Given,
        alike: impl Fn(&Pair) -> Option<Alike>,
    ) -> Result<(), EstimationError> {
        self.pairings.clear();
        self.good.clear();
        for pair in pairs.near {
            if given.shares[pair.target].is_empty() && given.of_any[pair.detection] == 0.0 {
                let Some(alike) = alike(pair).filter(Alike::takes_part) else { continue };
                self.pairings.push(Pairing { row: pair.target, column: pair.detection, cost: -alike.likeness });
                self.good.push(alike.is_pair());
            }
        }
        self.give(pairs, given)
    }

    /// The same of pairs that are looked for elsewhere, of targets and detections that nobody has yet.
    ///
    /// # Errors
    /// Where a cost is no number.
    pub fn assign(
        &mut self,
        pairs: &Pairs<'_>,
        given: &mut Given,
        alike: impl Iterator<Item = (usize, usize, Alike)>,
    ) -> Result<(), EstimationError> {
        self.pairings.clear();
        self.good.clear();
        for (row, column, alike) in alike.filter(|(_, _, alike)| alike.takes_part()) {
            self.pairings.push(Pairing { row, column, cost: -alike.likeness });
            self.good.push(alike.is_pair());
        }
        self.give(pairs, given)
    }

    fn give(&mut self, pairs: &Pairs<'_>, given: &mut Given) -> Result<(), EstimationError> {
        let assigned = self.assignment.solve(pairs.targets.len(), pairs.detections.len(), &self.pairings)?;
        for (pairing, good) in self.pairings.iter().zip(&self.good) {
            if *good && assigned.get(pairing.row) == Some(&Some(pairing.column)) {
                given.give(pairing.row, pairing.column);
            }
        }
        Ok(())
    }
}
