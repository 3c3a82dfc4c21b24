//! Smoothing while the data still come: what was believed a fixed number of steps ago, knowing all that came since.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use super::smoother::smoothed_by;
use crate::{EstimationError, Gaussian, Result, Transition};

/// The longest lag: what is older than this says nothing that the filter does not know.
const LONGEST: usize = 4096;

/// A Rauch-Tung-Striebel smoother over the last `lag` steps. Costs one smoothing step for each, at every step.
///
/// It stands behind any filter: each step is handed over with the belief it led to. For the extended and the unscented
/// filter [`Gaussian::linearized_extended`] and [`Gaussian::linearized_unscented`] give the step. Memory is allocated while
/// the first `lag` steps come and not after.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(remote = "FixedLag")]
pub struct FixedLag<const N: usize> {
    lag: usize,
    start: Gaussian<N>,
    /// Steps and what they led to after the update, the latest last; at most `lag` of them. `start` is before the first.
    steps: VecDeque<(Transition<N>, Gaussian<N>)>,
}

crate::checked!([const N: usize] FixedLag<N>);

impl<const N: usize> FixedLag<N> {
    fn restored(self) -> Result<Self> {
        Self::new(self.lag, self.start)?;
        let (got, expected) = (self.steps.len(), self.lag);
        if got > expected {
            return Err(EstimationError::Length { what: "steps kept by a fixed-lag smoother", got, expected });
        }
        Ok(self)
    }
}

impl<const N: usize> FixedLag<N> {
    /// A smoother of `lag` steps, 1 to 4096, over a filter that starts from `start`.
    ///
    /// # Errors
    /// Where `lag` is out of range.
    pub fn new(lag: usize, start: Gaussian<N>) -> Result<Self> {
        crate::error::require("lag", lag as f64, (1..=LONGEST).contains(&lag), "from 1 to 4096 steps")?;
        Ok(Self { lag, start, steps: VecDeque::new() })
    }

    /// Takes in the step `transition` to the belief `filtered`, which is after the update (or the prediction itself, where
    /// nothing was measured). Returns the smoothed belief `lag` steps ago; `None` until there are as many.
    ///
    /// # Errors
    /// Where a predicted covariance is singular; nothing is taken in then.
    pub fn push(&mut self, transition: &Transition<N>, filtered: &Gaussian<N>) -> Result<Option<Gaussian<N>>> {
        if self.steps.len() == self.lag {
            let then = self.oldest(transition, filtered, 1)?;
            if let Some((_, belief)) = self.steps.pop_front() {
                self.start = belief;
            }
            self.steps.push_back((*transition, *filtered));
            return Ok(Some(then));
        }
        let complete = self.steps.len() + 1 == self.lag;
        let then = if complete { Some(self.oldest(transition, filtered, 0)?) } else { None };
        self.steps.push_back((*transition, *filtered));
        Ok(then)
    }

    /// The belief before step `first`, smoothed by all steps since and the new one.
    fn oldest(&self, transition: &Transition<N>, filtered: &Gaussian<N>, first: usize) -> Result<Gaussian<N>> {
        let (mut next, mut lead) = (*filtered, transition);
        for (step, belief) in self.steps.iter().skip(first).rev() {
            next = smoothed_by(belief, lead, &next)?;
            lead = step;
        }
        let before = match first.checked_sub(1).and_then(|index| self.steps.get(index)) {
            Some((_, belief)) => belief,
            None => &self.start,
        };
        smoothed_by(before, lead, &next)
    }

    /// What is left at the end of a run: the smoothed beliefs since the one that [`push`](Self::push) returned last (or
    /// since the start), the oldest first, the filter's own last belief at the end.
    ///
    /// # Errors
    /// Where a predicted covariance is singular.
    pub fn finish(&self) -> Result<Vec<Gaussian<N>>> {
        let mut beliefs: Vec<_> = self.steps.iter().map(|(_, belief)| *belief).collect();
        let transitions: Vec<_> = self.steps.iter().skip(1).map(|(step, _)| *step).collect();
        if self.steps.len() < self.lag {
            beliefs.insert(0, self.start);
            let transitions: Vec<_> = self.steps.iter().map(|(step, _)| *step).collect();
            super::smooth(&mut beliefs, &transitions)?;
            return Ok(beliefs);
        }
        super::smooth(&mut beliefs, &transitions)?;
        Ok(beliefs)
    }
}
