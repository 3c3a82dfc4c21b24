//! Boxes in cells, so that those near a place are found without a look at all.

use pursuit_geometry::BBox;

/// Boxes that are no larger than a cell stand in the cell of their left upper corner: a grid for each size, which doubles from one
/// to the next. Keeps its memory from one frame to the next.
#[derive(Debug, Default)]
pub(super) struct Cells {
    /// How many boxes there are, where they are so few that no cells are made.
    few: usize,
    entries: Vec<Entry>,
    /// Of each size that there is: the binary logarithm of its cells' side, and where its entries end.
    grids: Vec<(i32, usize)>,
}

/// A box by its cell: ordered by grid, then by row, column and number, which stand in one word one after the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Entry(u128);

/// Rows and columns are told apart up to this far from the origin; beyond it all are one.
const FARTHEST: i64 = 1 << 40;
/// Bits of a number; of a row or a column.
const WHICH_BITS: u32 = 32;
const PLACE_BITS: u32 = 42;

impl Entry {
    fn new(size: i32, row: i64, column: i64, which: u32) -> Self {
        // From 0 on, so that their order is that of their bits.
        let place = |at: i64| (at.clamp(-FARTHEST, FARTHEST) + FARTHEST).unsigned_abs();
        let size = size.abs_diff(*SIZES.start());
        let places = u128::from(place(row)) << PLACE_BITS | u128::from(place(column));
        Self(u128::from(size) << (2 * PLACE_BITS + WHICH_BITS) | places << WHICH_BITS | u128::from(which))
    }

    /// Which grid it stands in.
    const fn grid(self) -> u128 {
        self.0 >> (2 * PLACE_BITS + WHICH_BITS)
    }

    const fn which(self) -> usize {
        (self.0 & ((1 << WHICH_BITS) - 1)) as usize
    }
}

/// Binary logarithms of the sides of the smallest and largest cells, in pixels.
const SIZES: std::ops::RangeInclusive<i32> = -4..=40;

impl Cells {
    /// Puts boxes into cells.
    pub fn fill<'a>(&mut self, boxes: impl ExactSizeIterator<Item = &'a BBox>) {
        self.entries.clear();
        self.grids.clear();
        self.few = if boxes.len() <= FEW { boxes.len() } else { 0 };
        if self.few > 0 {
            return;
        }
        self.entries.extend(boxes.enumerate().map(|(which, bbox)| {
            let (left, top, width, height) = bbox.ltwh();
            let side = width.max(height).max(f64::MIN_POSITIVE);
            let size = binary_exponent(side).saturating_add(1).clamp(*SIZES.start(), *SIZES.end());
            let cells = f64::from(-size).exp2();
            // More than 2³² boxes no memory holds.
            Entry::new(size, floored(top * cells), floored(left * cells), which as u32)
        }));
        self.entries.sort_unstable();
        let mut from = 0;
        for grid in self.entries.chunk_by(|a, b| a.grid() == b.grid()) {
            from += grid.len();
            self.grids.push((grid[0].grid() as i32 + SIZES.start(), from));
        }
    }

    /// All boxes that may overlap a range (left, top, right, bottom) once each of their sides was moved outward by the share `buffer` of their
    /// width or height: none is left out, and some are named that do not.
    #[inline]
    pub fn near(&self, range: &[f64; 4], buffer: f64, mut found: impl FnMut(usize)) {
        (0..self.few).for_each(&mut found);
        let mut from = 0;
        for &(size, to) in &self.grids {
            let entries = &self.entries[from..to];
            from = to;
            if entries.len() <= FEW {
                entries.iter().for_each(|e| found(e.which()));
                continue;
            }
            // A box reaches as far as a cell from its corner, and as much farther as it was widened.
            let cells = f64::from(-size).exp2();
            let at = |place: f64, more: f64| floored(place * cells + more);
            let (first, last) = (at(range[1], -1.0 - buffer), at(range[3], buffer));
            let (left, right) = (at(range[0], -1.0 - buffer), at(range[2], buffer));
            if last.saturating_sub(first) >= entries.len() as i64 {
                entries.iter().for_each(|e| found(e.which()));
                continue;
            }
            let mut rest = entries;
            for row in first..=last {
                let start = rest.partition_point(|e| *e < Entry::new(size, row, left, 0));
                rest = &rest[start..];
                let end = Entry::new(size, row, right, u32::MAX);
                rest.iter().take_while(|e| **e <= end).for_each(|e| found(e.which()));
            }
        }
    }
}

/// `⌊log₂ x⌋` of a positive number; that of the least normal number for those below it.
const fn binary_exponent(x: f64) -> i32 {
    (x.to_bits() >> 52 & 0x7ff) as i32 - 1023
}

/// `⌊x⌋`, the farthest number there is where it is beyond that: without the call that processors without a rounding instruction need.
fn floored(x: f64) -> i64 {
    let toward_zero = x as i64;
    if toward_zero as f64 > x { toward_zero.saturating_sub(1) } else { toward_zero }
}

/// So few are looked at one by one.
const FEW: usize = 40;

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_testkit::SplitMix;

    #[test]
    fn no_box_near_is_left_out() {
        let mut numbers = SplitMix(5);
        let mut cells = Cells::default();
        for trial in 0..60 {
            let one = |numbers: &mut SplitMix| {
                // From a sixteenth of a pixel to thousands, and some of no or of enormous size.
                let side = |numbers: &mut SplitMix| match numbers.below(20) {
                    0 => 0.0,
                    1 => 1e9 * numbers.unit(),
                    _ => (numbers.unit() * 16.0 - 4.0).exp2(),
                };
                let (left, top) = (1000.0 * (numbers.unit() - 0.5), 1000.0 * (numbers.unit() - 0.5));
                [left, top, left + side(numbers), top + side(numbers)]
            };
            let boxes: Vec<[f64; 4]> = (0..trial * 7).map(|_| one(&mut numbers)).collect();
            let as_boxes: Vec<BBox> = boxes.iter().map(|[l, t, r, b]| BBox::from_ltrb(*l, *t, *r, *b)).collect();
            cells.fill(as_boxes.iter());
            for _ in 0..20 {
                let (range, buffer) = (one(&mut numbers), numbers.unit());
                let mut found = vec![0; boxes.len()];
                cells.near(&range, buffer, |which| found[which] += 1);
                for (at, b) in boxes.iter().enumerate() {
                    let (dx, dy) = (buffer * (b[2] - b[0]), buffer * (b[3] - b[1]));
                    let apart =
                        b[0] - dx > range[2] || b[2] + dx < range[0] || b[1] - dy > range[3] || b[3] + dy < range[1];
                    assert!(found[at] <= 1 && (apart || found[at] == 1), "{b:?} and {range:?}: {}", found[at]);
                }
            }
        }
    }

    #[test]
    fn what_is_far_is_not_looked_at() {
        let mut cells = Cells::default();
        let grid = (0..100).flat_map(|x| (0..100).map(move |y| (f64::from(x) * 50.0, f64::from(y) * 50.0)));
        let small = grid.map(|(x, y)| BBox::from_ltwh(x, y, 30.0, 30.0));
        let boxes: Vec<BBox> = small.chain([BBox::from_ltwh(0.0, 0.0, 1e6, 1e6)]).collect();
        cells.fill(boxes.iter());
        let mut found = 0;
        cells.near(&[1000.0, 1000.0, 1030.0, 1030.0], 0.25, |_| found += 1);
        assert!((2..20).contains(&found), "{found}");
    }
}
