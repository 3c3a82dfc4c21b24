//! The first two stages of the cascade over some of the windows: what one thread does.

use super::cascade::{Candidate, Knowledge};
use super::cells::{BLOCK, Cells};
use super::grid::{Part, Scale};
use crate::appearance::Similarity;
use pursuit_vision::integral::IntegralImage;

/// The integral image of a part of the frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Summed<'a> {
    pub integral: &'a IntegralImage,
    /// First column and row of that part.
    pub origin: (usize, usize),
}

/// Scans its share of the windows by variance and ferns. Scratch alone.
#[derive(Debug, Clone, Default)]
pub(super) struct Worker {
    cells: Cells,
    columns: Vec<usize>,
    /// What passed in the last scan, in the order of the windows.
    pub candidates: Vec<Candidate>,
}

impl Worker {
    /// Scans the windows of `parts`.
    pub fn scan(&mut self, image: Summed<'_>, known: &Knowledge<'_>, parts: &[(Scale, Part)]) {
        self.candidates.clear();
        self.candidates.reserve(2 * known.params.ferns.most_windows);
        parts.iter().for_each(|(scale, part)| self.scan_scale(image, known, scale, part));
    }

    fn scan_scale(&mut self, image: Summed<'_>, known: &Knowledge<'_>, scale: &Scale, part: &Part) {
        self.cells.take(image.integral, image.origin, scale, part, known.params.ferns.smooth_px);
        let threshold = known.ferns.threshold(known.params.ferns.posterior);
        let (shift, _) = scale.shift();
        self.columns.clear();
        let (left, right) = (part.left, part.right);
        self.columns.extend((left..right).map(|i| (i as f64 * shift).round() as usize - image.origin.0));
        for row in part.top..part.bottom {
            for block in (left..right).step_by(BLOCK) {
                let count = BLOCK.min(right - block);
                let columns = &self.columns[block - left..][..count];
                let varied = varied(image, scale, row, columns, known.least_variance);
                if varied == 0 {
                    continue;
                }
                let mut sums = [0; BLOCK];
                known.ferns.score(&self.cells, row - part.top, block - left, &mut sums);
                for (k, &sum) in sums.iter().enumerate().take(count) {
                    if sum > threshold && varied & (1 << k) != 0 {
                        let similarity = Similarity { positive: 0.0, early: 0.0, negative: 0.5 };
                        self.candidates.push(Candidate { window: scale.window(block + k, row), sum, similarity });
                    }
                }
            }
        }
    }
}

/// Which of the windows of a row that begin at `columns` have at least that variance: a bit each.
fn varied(image: Summed<'_>, scale: &Scale, row: usize, columns: &[usize], least: f64) -> u64 {
    let (_, shift) = scale.shift();
    let top = (row as f64 * shift).round() as usize - image.origin.1;
    let (Some((above, above2)), Some((below, below2))) =
        (image.integral.row(top), image.integral.row(top + scale.height))
    else {
        return 0;
    };
    let n = (scale.width * scale.height) as f64;
    let mut varied = 0;
    for (k, &left) in columns.iter().enumerate() {
        let right = left + scale.width;
        let (Some(s), Some(q)) = (above.get(right), above2.get(right)) else { return varied };
        let sum = below[right].wrapping_sub(below[left]).wrapping_sub(*s).wrapping_add(above[left]);
        let squares = below2[right] + above2[left] - below2[left] - q;
        let mean = f64::from(sum) / n;
        varied |= u64::from(squares as f64 / n - mean * mean >= least) << k;
    }
    varied
}

/// Shares `parts` out into `shares` of nearly as many windows each, whole rows of a part apart where need be; `ends` says
/// where each share ends.
pub(super) fn divide(parts: &mut Vec<(Scale, Part)>, shares: usize, ends: &mut Vec<usize>) {
    ends.clear();
    let all: usize = parts.iter().map(|(_, part)| part.windows()).sum();
    let (mut before, mut at) = (0, 0);
    for share in 1..shares {
        let goal = all * share / shares;
        while let Some((scale, part)) = parts.get(at).copied() {
            let across = part.right - part.left;
            let rows = goal.saturating_sub(before) / across.max(1);
            if rows >= part.bottom - part.top {
                before += part.windows();
                at += 1;
                continue;
            }
            if rows > 0 {
                let middle = part.top + rows;
                parts[at] = (scale, Part { bottom: middle, ..part });
                parts.insert(at + 1, (scale, Part { top: middle, ..part }));
                before += rows * across;
                at += 1;
            }
            break;
        }
        ends.push(at);
    }
    ends.push(parts.len());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_hold_every_row_once() {
        let scale = |columns| Scale { width: 20, height: 20, columns, rows: 50 };
        let part = |right, bottom| Part { left: 2, right, top: 1, bottom };
        let whole = vec![(scale(40), part(40, 40)), (scale(30), part(30, 9)), (scale(5), part(5, 3))];
        let rows = |parts: &[(Scale, Part)]| {
            let rows = parts.iter().flat_map(|(s, p)| (p.top..p.bottom).map(|row| (s.columns, p.left, p.right, row)));
            rows.collect::<Vec<_>>()
        };
        let windows = |parts: &[(Scale, Part)]| parts.iter().map(|(_, p)| p.windows()).sum::<usize>();
        for shares in 1..=16 {
            let (mut parts, mut ends) = (whole.clone(), vec![99]);
            divide(&mut parts, shares, &mut ends);
            assert_eq!(rows(&parts), rows(&whole), "the order stays");
            assert_eq!((ends.len(), ends.last()), (shares, Some(&parts.len())));
            let mut from = 0;
            for end in ends {
                let (own, fair) = (windows(&parts[from..end]), windows(&whole) / shares);
                assert!(own.abs_diff(fair) <= 2 * 38, "{own} of {fair}");
                from = end;
            }
        }
        let (mut none, mut ends) = (Vec::new(), Vec::new());
        divide(&mut none, 3, &mut ends);
        assert_eq!(ends, [0, 0, 0]);
    }
}
