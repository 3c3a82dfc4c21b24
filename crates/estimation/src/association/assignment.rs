//! The assignment problem: rows to columns at least cost, each column once, by shortest augmenting paths with potentials
//! (Kuhn 1955; Jonker and Volgenant 1987). Rows may also stay without a column, at a cost of their own.

use crate::{EstimationError, Result};

/// A solver that keeps its memory from one problem to the next.
#[derive(Debug, Clone, Default)]
pub struct Assignment {
    /// Costs row by row, forbidden pairs infinite.
    costs: Vec<f64>,
    unassigned: Vec<f64>,
    /// Potentials; `costs[i][j] ≥ row[i] + column[j]`, with equality where `i` has `j`.
    row: Vec<f64>,
    column: Vec<f64>,
    /// The row that has each column.
    owner: Vec<Option<usize>>,
    /// Least reduced cost at which each column was reached in the current search, from which column, and whether it is done.
    reached: Vec<f64>,
    from: Vec<Option<usize>>,
    done: Vec<bool>,
    answer: Vec<Option<usize>>,
}

impl Assignment {
    /// A solver.
    pub fn new() -> Self {
        Self::default()
    }

    /// The column of each row (`None`: it stays without), so that the sum of `cost(row, column)` over assigned rows and
    /// `unassigned(row)` over the others is least. Infinite costs forbid a pair. Time grows with
    /// `rows² (rows + columns)` at worst.
    ///
    /// # Errors
    /// Where a cost is NaN or −∞, or that of staying without is not finite.
    pub fn solve(
        &mut self,
        rows: usize,
        columns: usize,
        cost: impl Fn(usize, usize) -> f64,
        unassigned: impl Fn(usize) -> f64,
    ) -> Result<&[Option<usize>]> {
        self.prepare(rows, columns, cost, unassigned)?;
        for row in 0..rows {
            self.assign(row, columns);
        }
        self.answer.clear();
        self.answer.resize(rows, None);
        for (column, owner) in self.owner.iter().take(columns).enumerate() {
            if let Some(slot) = owner.and_then(|row| self.answer.get_mut(row)) {
                *slot = Some(column);
            }
        }
        Ok(&self.answer)
    }

    /// What the last solution cost.
    pub fn total(&self) -> f64 {
        let columns = self.owner.len() - self.answer.len();
        let each = self.answer.iter().enumerate();
        each.map(|(row, column)| column.map_or(self.unassigned[row], |column| self.costs[row * columns + column])).sum()
    }

    fn prepare(
        &mut self,
        rows: usize,
        columns: usize,
        cost: impl Fn(usize, usize) -> f64,
        unassigned: impl Fn(usize) -> f64,
    ) -> Result<()> {
        self.costs.clear();
        self.unassigned.clear();
        // A failed call leaves a solution of nothing.
        self.answer.clear();
        self.owner.clear();
        for row in 0..rows {
            for column in 0..columns {
                let value = cost(row, column);
                if value.is_nan() || value == f64::NEG_INFINITY {
                    return Err(EstimationError::NotFinite { what: "the cost of an assignment" });
                }
                self.costs.push(value);
            }
            let value = unassigned(row);
            if !value.is_finite() {
                return Err(EstimationError::NotFinite { what: "the cost of staying unassigned" });
            }
            self.unassigned.push(value);
        }
        // Behind the real columns each row has one of its own for staying without.
        let all = rows + columns;
        for values in [&mut self.column, &mut self.reached] {
            values.clear();
            values.resize(all, 0.0);
        }
        self.row.clear();
        self.row.resize(rows, 0.0);
        self.owner.resize(all, None);
        self.from.clear();
        self.from.resize(all, None);
        self.done.clear();
        self.done.resize(all, false);
        Ok(())
    }

    fn cost(&self, row: usize, column: usize, columns: usize) -> f64 {
        match column.checked_sub(columns) {
            None => self.costs[row * columns + column],
            Some(own) if own == row => self.unassigned[row],
            Some(_) => f64::INFINITY,
        }
    }

    /// Finds the cheapest path from `row` to a free column, and takes it. There is one: the row's own column is free.
    fn assign(&mut self, row: usize, columns: usize) {
        self.reached.fill(f64::INFINITY);
        self.from.fill(None);
        self.done.fill(false);
        let (mut current, mut via) = (row, None);
        let free = loop {
            let (mut least, mut nearest) = (f64::INFINITY, None);
            for column in 0..self.owner.len() {
                if self.done[column] {
                    continue;
                }
                let reduced = self.cost(current, column, columns) - self.row[current] - self.column[column];
                if reduced < self.reached[column] {
                    (self.reached[column], self.from[column]) = (reduced, via);
                }
                if self.reached[column] < least {
                    (least, nearest) = (self.reached[column], Some(column));
                }
            }
            let Some(nearest) = nearest else { return };
            // Potentials move so that the nearest column costs nothing more.
            self.row[row] += least;
            for column in 0..self.owner.len() {
                if self.done[column] {
                    self.column[column] -= least;
                    if let Some(owner) = self.owner[column] {
                        self.row[owner] += least;
                    }
                } else {
                    self.reached[column] -= least;
                }
            }
            self.done[nearest] = true;
            via = Some(nearest);
            match self.owner[nearest] {
                Some(owner) => current = owner,
                None => break nearest,
            }
        };
        // Along the path back every column goes to the row that the one before it had.
        let mut column = free;
        while let Some(before) = self.from[column] {
            self.owner[column] = self.owner[before];
            column = before;
        }
        self.owner[column] = Some(row);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A number in [0, 1) from a counter.
    fn number(counter: u64) -> f64 {
        pursuit_testkit::SplitMix::after(counter).unit()
    }

    /// The least cost of rows from `row` on, by trying everything.
    fn tried(row: usize, rows: usize, taken: u32, cost: &[Vec<f64>], without: &[f64]) -> f64 {
        if row == rows {
            return 0.0;
        }
        let mut best = without[row] + tried(row + 1, rows, taken, cost, without);
        for (column, value) in cost[row].iter().enumerate() {
            if taken >> column & 1 == 0 && value.is_finite() {
                best = best.min(value + tried(row + 1, rows, taken | 1 << column, cost, without));
            }
        }
        best
    }

    #[test]
    fn no_other_assignment_costs_less() {
        let mut solver = Assignment::new();
        for problem in 0..400_u64 {
            let (rows, columns) = ((problem % 6) as usize, (problem / 6 % 7) as usize);
            let seed = problem * 1000;
            let cost: Vec<Vec<f64>> = (0..rows)
                .map(|r| {
                    let each = (0..columns).map(|c| {
                        let value = number(seed + (r * 10 + c) as u64);
                        // Some forbidden, some negative, many equal.
                        if value < 0.2 { f64::INFINITY } else { (value * 8.0).floor() - 3.0 }
                    });
                    each.collect()
                })
                .collect();
            let without: Vec<f64> = (0..rows).map(|r| number(seed + 500 + r as u64) * 6.0 - 1.0).collect();
            let answer = solver.solve(rows, columns, |r, c| cost[r][c], |r| without[r]).unwrap().to_vec();
            assert_eq!(answer.len(), rows);
            let mut sum = 0.0;
            for (r, column) in answer.iter().enumerate() {
                sum += column.map_or(without[r], |c| cost[r][c]);
                assert!(column.is_none() || answer.iter().filter(|other| *other == column).count() == 1);
            }
            let expected = tried(0, rows, 0, &cost, &without);
            assert!((sum - expected).abs() < 1e-9, "problem {problem}: {sum}, not {expected}");
            assert!((solver.total() - expected).abs() < 1e-9);
        }
    }

    /// Potentials that bound every cost from below and meet those that were taken prove the least cost at any size.
    #[test]
    fn the_potentials_prove_a_large_solution() {
        for (rows, columns) in [(60, 80), (80, 60), (1, 50), (50, 1)] {
            let cost = |r: usize, c: usize| number((r * 100 + c) as u64) * 100.0;
            let mut solver = Assignment::new();
            let answer = solver.solve(rows, columns, cost, |_| 30.0).unwrap().to_vec();
            for r in 0..rows {
                for c in 0..columns {
                    assert!(cost(r, c) - solver.row[r] - solver.column[c] > -1e-9);
                }
                let (paid, column) = answer[r].map_or((30.0, columns + r), |c| (cost(r, c), c));
                assert!((paid - solver.row[r] - solver.column[column]).abs() < 1e-9, "row {r}");
            }
            // Columns that nobody has are worth nothing, and none is worth more.
            for (column, owner) in solver.owner.iter().enumerate() {
                assert!(solver.column[column] <= 1e-9 && (owner.is_some() || solver.column[column] == 0.0));
            }
        }
    }

    #[test]
    fn costs_that_are_none_are_refused() {
        let mut solver = Assignment::new();
        for bad in [f64::NAN, f64::NEG_INFINITY] {
            assert!(matches!(solver.solve(1, 1, |_, _| bad, |_| 1.0), Err(EstimationError::NotFinite { .. })));
        }
        for bad in [f64::NAN, f64::INFINITY] {
            assert!(matches!(solver.solve(1, 1, |_, _| 1.0, |_| bad), Err(EstimationError::NotFinite { .. })));
        }
        assert_eq!(solver.total(), 0.0);
        assert_eq!(solver.solve(2, 1, |_, _| f64::INFINITY, |_| 1.0).unwrap(), [None, None]);
        assert_eq!(solver.total(), 2.0);
    }
}
