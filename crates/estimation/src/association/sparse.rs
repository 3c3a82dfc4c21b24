//! The assignment problem where most pairs are impossible: shortest augmenting paths that go no farther than they must.

use super::{Pairing, check};
use crate::Result;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Pairs rows with columns at least cost, each once (Jonker and Volgenant 1987, on the pairs that there are). Time and memory go with
/// the pairs; only where many rows want the same columns each row may look at all of them. Keeps its memory from one problem to the next.
#[derive(Debug, Clone, Default)]
pub struct SparseAssignment {
    /// Where the pairs of each row begin; one more, where the last ones end.
    starts: Vec<usize>,
    /// Column and cost of the pairs that pay, row by row.
    pairs: Vec<(usize, f64)>,
    /// Potentials: `cost ≥ row + column`, with equality for the pairs taken. To stay without costs 0, in a column of the row's own.
    row: Vec<f64>,
    column: Vec<f64>,
    /// The row that has each column.
    owner: Vec<Option<usize>>,
    answer: Vec<Option<usize>>,
    /// The current search: how far each column is and from which row it was reached; which ones were; which are done, with their distances.
    reached: Vec<f64>,
    from: Vec<usize>,
    touched: Vec<usize>,
    done: Vec<(usize, f64)>,
    heap: BinaryHeap<Reached>,
}

/// A column, and how far it is; the nearest is the greatest, of equals the first column.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Reached {
    distance: f64,
    column: usize,
}

impl Eq for Reached {}

impl Ord for Reached {
    fn cmp(&self, other: &Self) -> Ordering {
        other.distance.total_cmp(&self.distance).then(other.column.cmp(&self.column))
    }
}

impl PartialOrd for Reached {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl SparseAssignment {
    /// A solver.
    pub fn new() -> Self {
        Self::default()
    }

    /// The column of each row (`None`: it stays without), so that the costs of the pairs taken sum up to the least. A pair that
    /// does not pay is never taken; of a pair given twice the cheaper counts.
    ///
    /// # Errors
    /// Where a pair is of a row or column that there is not, or a cost is not finite; the answer is then empty.
    pub fn solve(&mut self, rows: usize, columns: usize, pairs: &[Pairing]) -> Result<&[Option<usize>]> {
        self.answer.clear();
        check(rows, columns, pairs)?;
        self.prepare(rows, columns, pairs);
        for row in 0..rows {
            self.take_free(row);
        }
        for row in 0..rows {
            if self.answer[row].is_none() && self.row[row] < 0.0 {
                self.assign(row);
            }
        }
        Ok(&self.answer)
    }

    fn prepare(&mut self, rows: usize, columns: usize, pairs: &[Pairing]) {
        let Self { starts, pairs: own, row, column, owner, answer, reached, from, touched, .. } = self;
        touched.clear();
        let pays = || pairs.iter().filter(|pair| pair.cost < 0.0);
        starts.clear();
        starts.resize(rows + 2, 0);
        // Counted two places on, and moved one place on by filling: in the end each row's own start.
        pays().for_each(|pair| starts[pair.row + 2] += 1);
        for at in 2..starts.len() {
            starts[at] += starts[at - 1];
        }
        own.clear();
        own.resize(pays().count(), (0, 0.0));
        row.clear();
        row.resize(rows, 0.0);
        for pair in pays() {
            let at = &mut starts[pair.row + 1];
            own[*at] = (pair.column, pair.cost);
            *at += 1;
            row[pair.row] = row[pair.row].min(pair.cost);
        }
        column.clear();
        column.resize(columns, 0.0);
        owner.clear();
        owner.resize(columns, None);
        answer.resize(rows, None);
        reached.clear();
        reached.resize(columns, f64::INFINITY);
        from.clear();
        from.resize(columns, 0);
    }

    /// Gives a row its cheapest column where nobody has it.
    fn take_free(&mut self, row: usize) {
        let own = &self.pairs[self.starts[row]..self.starts[row + 1]];
        let free = own.iter().find(|(column, cost)| *cost == self.row[row] && self.owner[*column].is_none());
        if let Some((column, _)) = free {
            (self.owner[*column], self.answer[row]) = (Some(row), Some(*column));
        }
    }

    /// Finds the cheapest path from `start` to a free column, or to a row that is best left without, and takes it.
    fn assign(&mut self, start: usize) {
        self.touched.drain(..).for_each(|column| self.reached[column] = f64::INFINITY);
        self.done.clear();
        self.heap.clear();
        // The nearest row that may stay without: how far that is, and which.
        let mut alone = (f64::INFINITY, start);
        let (mut current, mut here) = (start, 0.0);
        let (distance, end) = loop {
            if here - self.row[current] < alone.0 {
                alone = (here - self.row[current], current);
            }
            for &(column, cost) in &self.pairs[self.starts[current]..self.starts[current + 1]] {
                let distance = here + (cost - self.row[current] - self.column[column]).max(0.0);
                if distance < self.reached[column] && distance < alone.0 {
                    if self.reached[column] == f64::INFINITY {
                        self.touched.push(column);
                    }
                    (self.reached[column], self.from[column]) = (distance, current);
                    self.heap.push(Reached { distance, column });
                }
            }
            let next = loop {
                // What was reached on a shorter way since is no longer where the heap has it.
                match self.heap.pop() {
                    Some(next) if next.distance > self.reached[next.column] => {}
                    other => break other,
                }
            };
            match next {
                Some(Reached { distance, column }) if distance < alone.0 => match self.owner[column] {
                    None => break (distance, Some(column)),
                    Some(owner) => {
                        self.done.push((column, distance));
                        (current, here) = (owner, distance);
                    }
                },
                Some(_) | None => break (alone.0, None),
            }
        };
        // Potentials move so that every pair of the path costs nothing more.
        self.row[start] += distance;
        for (column, at) in &self.done {
            self.column[*column] -= distance - at;
            if let Some(owner) = self.owner[*column] {
                self.row[owner] += distance - at;
            }
        }
        let mut column = match end {
            Some(column) => Some(column),
            None => self.answer[alone.1].take(),
        };
        // Along the path back every row hands its column to the row before.
        while let Some(given) = column {
            let row = self.from[given];
            self.owner[given] = Some(row);
            column = self.answer[row].replace(given);
            if row == start {
                break;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::association::Assignment;

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

    /// Potentials that bound every cost from below and meet those of the pairs taken prove the least cost at any size.
    #[test]
    fn the_potentials_prove_a_large_solution() {
        let number = |counter: u64| pursuit_testkit::SplitMix::after(counter).unit();
        for (rows, columns, share) in [(300, 200, 0.2), (200, 300, 0.9), (1, 400, 1.0), (400, 1, 1.0), (150, 150, 1.0)]
        {
            let all = (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
            let pair = |(row, column): (usize, usize)| {
                let at = (row * 1000 + column) as u64 * 2;
                (number(at) < share).then(|| Pairing { row, column, cost: 3.0 - 10.0 * number(at + 1) })
            };
            let pairs: Vec<Pairing> = all.filter_map(pair).collect();
            let mut sparse = SparseAssignment::new();
            let answer = sparse.solve(rows, columns, &pairs).unwrap().to_vec();
            let (mut sum, mut bound) = (0.0, 0.0);
            for pair in &pairs {
                let reduced = pair.cost - sparse.row[pair.row] - sparse.column[pair.column];
                assert!(reduced > -1e-9, "{pair:?}: {reduced}");
                if answer[pair.row] == Some(pair.column) {
                    assert!(reduced < 1e-9, "{pair:?}: {reduced}");
                    sum += pair.cost;
                }
            }
            for (row, column) in answer.iter().enumerate() {
                assert!(sparse.row[row] <= 1e-9, "to stay without costs nothing");
                bound += sparse.row[row];
                assert!(column.is_none_or(|c| sparse.owner[c] == Some(row)));
            }
            for (column, owner) in sparse.owner.iter().enumerate() {
                assert!(sparse.column[column] <= 1e-9 && (owner.is_some() || sparse.column[column] == 0.0));
                bound += sparse.column[column];
            }
            // Both sides of the duality are equal: nothing is cheaper.
            assert!((sum - bound).abs() < 1e-6, "{rows}x{columns}: {sum}, not {bound}");
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
