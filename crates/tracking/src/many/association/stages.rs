//! Assignment stage by stage: what one stage has left takes part in the next.

use super::near::Pair;
use super::{Given, Pairs};
use pursuit_estimation::EstimationError;
use pursuit_estimation::association::{Pairing, SparseAssignment};

/// Keeps its memory from one frame to the next.
#[derive(Default)]
pub(super) struct Stages {
    pairings: Vec<Pairing>,
    assignment: SparseAssignment,
}

impl Stages {
    /// Pairs what nobody has yet, as many as `likeness` allows and of these ways the likest: it is above 0 for a pair that may be,
    /// up to 1, and `None` for one that may not.
    ///
    /// # Errors
    /// Where a likeness is no number.
    pub fn stage(
        &mut self,
        pairs: &Pairs<'_>,
        given: &mut Given,
        likeness: impl Fn(&Pair) -> Option<f64>,
    ) -> Result<(), EstimationError> {
        self.pairings.clear();
        for pair in pairs.near {
            if given.shares[pair.target].is_empty() && given.of_any[pair.detection] == 0.0 {
                let likeness = likeness(pair);
                self.pairings.extend(likeness.map(|l| Pairing { row: pair.target, column: pair.detection, cost: -l }));
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
        pairings: impl Iterator<Item = Pairing>,
    ) -> Result<(), EstimationError> {
        self.pairings.clear();
        self.pairings.extend(pairings);
        self.give(pairs, given)
    }

    fn give(&mut self, pairs: &Pairs<'_>, given: &mut Given) -> Result<(), EstimationError> {
        let assigned = self.assignment.solve(pairs.targets.len(), pairs.detections.len(), &self.pairings)?;
        for (target, detection) in assigned.iter().enumerate() {
            detection.iter().for_each(|d| given.give(target, *d));
        }
        Ok(())
    }
}
