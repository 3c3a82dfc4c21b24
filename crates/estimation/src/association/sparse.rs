//! The assignment problem where most pairs are impossible: rows and columns that no chain of pairs joins are solved apart.

use super::Assignment;
use crate::{EstimationError, Result};

/// A pair that is possible, and what it costs beside leaving its row and its column alone; negative: it pays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pairing {
    /// The row.
    pub row: usize,
    /// The column.
    pub column: usize,
    /// What it costs more than no pair, finite.
    pub cost: f64,
}

/// Pairs rows with columns at least cost, each once, group by group of what shares rows or columns. Keeps its memory from one
/// problem to the next.
#[derive(Debug, Clone, Default)]
pub struct SparseAssignment {
    /// A forest over rows and, behind them, columns: each points to one of its group, the root to itself.
    parent: Vec<usize>,
    /// The pairs that pay, those of a group together: root, place in the problem.
    groups: Vec<(usize, usize)>,
    rows: Vec<usize>,
    columns: Vec<usize>,
    /// Where each row or column stands in its group.
    place: Vec<usize>,
    costs: Vec<f64>,
    dense: Assignment,
    answer: Vec<Option<usize>>,
}

impl SparseAssignment {
    /// A solver.
    pub fn new() -> Self {
        Self::default()
    }

    /// The column of each row (`None`: it stays without), so that the costs of the pairs taken sum up to the least. A pair that
    /// does not pay is never taken; of a pair given twice the last counts.
    ///
    /// # Errors
    /// Where a pair is of a row or column that there is not, or a cost is not finite; the answer is then empty.
    pub fn solve(&mut self, rows: usize, columns: usize, pairs: &[Pairing]) -> Result<&[Option<usize>]> {
        self.answer.clear();
        for pair in pairs {
            if pair.row >= rows || pair.column >= columns {
                let (got, expected) = (pair.row.max(pair.column), rows.max(columns));
                return Err(EstimationError::Length { what: "rows and columns of a pair", got, expected });
            }
            if !pair.cost.is_finite() {
                return Err(EstimationError::NotFinite { what: "the cost of an assignment" });
            }
        }
        self.parent.clear();
        self.parent.extend(0..rows + columns);
        self.place.clear();
        self.place.resize(rows + columns, usize::MAX);
        let pays = || pairs.iter().enumerate().filter(|(_, pair)| pair.cost < 0.0);
        for (_, pair) in pays() {
            let (a, b) = (root(&mut self.parent, pair.row), root(&mut self.parent, rows + pair.column));
            self.parent[a.max(b)] = a.min(b);
        }
        self.groups.clear();
        for (at, pair) in pays() {
            let group = root(&mut self.parent, pair.row);
            self.groups.push((group, at));
        }
        self.groups.sort_unstable();
        self.answer.resize(rows, None);
        let groups = std::mem::take(&mut self.groups);
        let solved = groups.chunk_by(|a, b| a.0 == b.0).try_for_each(|group| self.group(rows, pairs, group));
        self.groups = groups;
        solved?;
        Ok(&self.answer)
    }

    /// Solves one group.
    fn group(&mut self, rows: usize, pairs: &[Pairing], group: &[(usize, usize)]) -> Result<()> {
        if let [(_, at)] = group {
            self.answer[pairs[*at].row] = Some(pairs[*at].column);
            return Ok(());
        }
        self.rows.clear();
        self.columns.clear();
        for (_, at) in group {
            for (node, known, all) in
                [(pairs[*at].row, &mut self.rows, 0), (pairs[*at].column, &mut self.columns, rows)]
            {
                if self.place[all + node] == usize::MAX {
                    self.place[all + node] = known.len();
                    known.push(node);
                }
            }
        }
        let width = self.columns.len();
        self.costs.clear();
        self.costs.resize(self.rows.len() * width, f64::INFINITY);
        for (_, at) in group {
            let pair = &pairs[*at];
            self.costs[self.place[pair.row] * width + self.place[rows + pair.column]] = pair.cost;
        }
        let assigned = self.dense.solve(self.rows.len(), width, |r, c| self.costs[r * width + c], |_| 0.0)?;
        for (row, column) in self.rows.iter().zip(assigned) {
            self.answer[*row] = column.and_then(|c| self.columns.get(c)).copied();
        }
        Ok(())
    }
}

/// The root of a node's group; shortens the way there.
fn root(parent: &mut [usize], mut node: usize) -> usize {
    while parent[node] != node {
        parent[node] = parent[parent[node]];
        node = parent[node];
    }
    node
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_apart_cost_what_all_together_cost() {
        let number = |counter: u64| pursuit_testkit::SplitMix::after(counter).unit();
        let (mut sparse, mut dense) = (SparseAssignment::new(), Assignment::new());
        for problem in 0..300_u64 {
            let (rows, columns) = ((problem % 13) as usize, (problem / 13 % 11) as usize);
            let cost = |r: usize, c: usize| {
                let value = number(problem * 1000 + (r * 20 + c) as u64);
                if value < 0.7 { f64::INFINITY } else { value * 10.0 - 9.0 }
            };
            let all = (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
            let pairs: Vec<_> = all
                .map(|(row, column)| Pairing { row, column, cost: cost(row, column) })
                .filter(|p| p.cost.is_finite())
                .collect();
            let answer = sparse.solve(rows, columns, &pairs).unwrap().to_vec();
            let sum: f64 = answer.iter().enumerate().filter_map(|(r, c)| Some(cost(r, (*c)?))).sum();
            let mut taken: Vec<usize> = answer.iter().flatten().copied().collect();
            taken.sort_unstable();
            assert!(taken.windows(2).all(|w| w[0] != w[1]), "problem {problem}");
            dense.solve(rows, columns, cost, |_| 0.0).unwrap();
            assert!((sum - dense.total()).abs() < 1e-9, "problem {problem}: {sum}, not {}", dense.total());
        }
    }

    #[test]
    fn pairs_that_are_none_are_refused() {
        let mut sparse = SparseAssignment::new();
        let pair = |row, column, cost| [Pairing { row, column, cost }];
        for bad in [pair(2, 0, -1.0), pair(0, 2, -1.0), pair(0, 0, f64::NAN), pair(0, 0, f64::NEG_INFINITY)] {
            assert!(sparse.solve(2, 2, &bad).is_err());
        }
        assert_eq!(sparse.solve(2, 2, &pair(1, 0, 0.5)).unwrap(), [None, None], "it does not pay");
        assert_eq!(sparse.solve(2, 2, &pair(1, 0, -0.5)).unwrap(), [None, Some(0)]);
    }
}
