use super::cells::{BLOCK, Cells, SIDE};
use super::params::FernParams;
use crate::appearance::draw;
use multiversion::multiversion;
use serde::{Deserialize, Serialize};

/// The ensemble of random ferns (kalal2012, section 5.3): each compares pairs of cells; what it saw before with the same
/// outcome says how likely a window is the object. The mean over the ferns decides.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Raw", into = "Raw")]
pub(super) struct Ferns {
    count: usize,
    comparisons: usize,
    /// Cells compared, fern by fern.
    pub(super) pairs: Vec<(u16, u16)>,
    /// Cells that any fern compares.
    used: Vec<u16>,
    /// How often each outcome was the object, and was not, fern by fern.
    pub(super) seen: Vec<(u16, u16)>,
    /// `seen` as shares of `UNIT`.
    posteriors: Vec<u16>,
}

/// What is stored: outcomes that were never seen are left out.
#[derive(Clone, Serialize, Deserialize)]
struct Raw {
    count: usize,
    comparisons: usize,
    pairs: Vec<(u16, u16)>,
    seen: Vec<(u32, u16, u16)>,
}

impl From<Ferns> for Raw {
    fn from(it: Ferns) -> Self {
        let seen =
            it.seen.iter().enumerate().filter(|(_, s)| **s != (0, 0)).map(|(i, s)| (i as u32, s.0, s.1)).collect();
        Self { count: it.count, comparisons: it.comparisons, pairs: it.pairs, seen }
    }
}

impl TryFrom<Raw> for Ferns {
    type Error = &'static str;

    fn try_from(raw: Raw) -> Result<Self, Self::Error> {
        if !(1..=16).contains(&raw.count) || !(1..=14).contains(&raw.comparisons) {
            return Err("there are 1 to 16 ferns of 1 to 14 comparisons");
        }
        let inside = |cell: u16| usize::from(cell) < SIDE * SIDE;
        if raw.pairs.len() != raw.count * raw.comparisons || raw.pairs.iter().any(|p| !inside(p.0) || !inside(p.1)) {
            return Err("the cells of the ferns do not fit them");
        }
        let mut ferns = Self::of(raw.count, raw.comparisons, raw.pairs);
        for (i, positive, negative) in raw.seen {
            let slot = ferns.seen.get_mut(i as usize).ok_or("an outcome of the ferns is out of range")?;
            *slot = (positive, negative);
            ferns.posteriors[i as usize] = posterior(ferns.count, (positive, negative));
        }
        Ok(ferns)
    }
}

/// A posterior of one, of `count` ferns: their sum fits 16 bits.
const fn unit(count: usize) -> u16 {
    (u16::MAX as usize / count) as u16
}

fn posterior(count: usize, (positive, negative): (u16, u16)) -> u16 {
    let all = u32::from(positive) + u32::from(negative);
    (u32::from(unit(count)) * u32::from(positive)).checked_div(all).unwrap_or(0) as u16
}

impl Ferns {
    /// Ferns that have seen nothing; `random` chooses what they compare: two cells in line, across or down.
    pub fn new(params: &FernParams, random: &mut u64) -> Self {
        let mut cell = || (draw(random) % SIDE as u64) as u16;
        let side = SIDE as u16;
        let pairs = (0..params.count * params.comparisons).map(|i| {
            let (x, y, mut other) = (cell(), cell(), cell());
            let along = if i % 2 == 0 { x } else { y };
            if other == along {
                other = (other + side / 2) % side;
            }
            let at = |x: u16, y: u16| y * side + x;
            if i % 2 == 0 { (at(x, y), at(other, y)) } else { (at(x, y), at(x, other)) }
        });
        Self::of(params.count, params.comparisons, pairs.collect())
    }

    fn of(count: usize, comparisons: usize, pairs: Vec<(u16, u16)>) -> Self {
        let mut used: Vec<u16> = pairs.iter().flat_map(|p| [p.0, p.1]).collect();
        used.sort_unstable();
        used.dedup();
        let outcomes = count << comparisons;
        Self { count, comparisons, pairs, used, seen: vec![(0, 0); outcomes], posteriors: vec![0; outcomes] }
    }

    /// Whether they are what `params` ask for.
    pub const fn fits(&self, params: &FernParams) -> bool {
        self.count == params.count && self.comparisons == params.comparisons
    }

    /// Cells that are compared.
    pub fn used(&self) -> &[u16] {
        &self.used
    }

    /// The sum that is reached by a mean posterior of `share`.
    pub fn threshold(&self, share: f64) -> u16 {
        (share * f64::from(unit(self.count)) * self.count as f64) as u16
    }

    /// Sums of the posteriors of the windows of a block.
    pub fn score(&self, cells: &Cells, row: usize, column: usize, sums: &mut [u16; BLOCK]) {
        sums.fill(0);
        let low = self.comparisons.saturating_sub(8);
        for (pairs, posteriors) in
            self.pairs.chunks_exact(self.comparisons).zip(self.posteriors.chunks_exact(1 << self.comparisons))
        {
            let (mut high_bits, mut low_bits) = ([0u8; BLOCK], [0u8; BLOCK]);
            let (first, rest) = pairs.split_at(self.comparisons - low);
            compare(cells, first, row, column, &mut high_bits);
            compare(cells, rest, row, column, &mut low_bits);
            for ((sum, high), bits) in sums.iter_mut().zip(&high_bits).zip(&low_bits) {
                let outcome = (usize::from(*high) << low) | usize::from(*bits);
                *sum += posteriors[outcome];
            }
        }
    }

    /// Writes the outcome of every fern for one view to `outcomes`: indices over all ferns.
    pub fn outcomes(&self, view: &[u8; SIDE * SIDE], outcomes: &mut Vec<u32>) {
        outcomes.clear();
        outcomes.extend(self.pairs.chunks_exact(self.comparisons).enumerate().map(|(fern, pairs)| {
            let bits = pairs
                .iter()
                .fold(0u32, |bits, (a, b)| (bits << 1) | u32::from(view[usize::from(*a)] > view[usize::from(*b)]));
            ((fern as u32) << self.comparisons) | bits
        }));
    }

    /// Sum of the posteriors of these outcomes.
    pub fn sum(&self, outcomes: &[u32]) -> u16 {
        outcomes.iter().map(|&o| self.posteriors[o as usize]).sum()
    }

    /// Counts a view of these outcomes as the object, or not.
    pub fn learn(&mut self, outcomes: &[u32], is_object: bool) {
        for &outcome in outcomes {
            let seen = &mut self.seen[outcome as usize];
            let side = if is_object { &mut seen.0 } else { &mut seen.1 };
            *side = side.saturating_add(1);
            if *side == u16::MAX {
                // Room for more: what is kept is the share.
                *seen = (seen.0 / 2, seen.1 / 2);
            }
            self.posteriors[outcome as usize] = posterior(self.count, *seen);
        }
    }
}

/// Appends one bit for each comparison to the bits of each window of a block.
#[multiversion(targets("x86_64+avx2", "x86_64+sse4.1", "aarch64+neon"))]
fn compare(cells: &Cells, pairs: &[(u16, u16)], row: usize, column: usize, bits: &mut [u8; BLOCK]) {
    for &(a, b) in pairs {
        let (Some(a), Some(b)) = (cells.block(a, row, column), cells.block(b, row, column)) else { return };
        for k in 0..BLOCK {
            bits[k] = (bits[k] << 1) | u8::from(a[k] > b[k]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::cells::{tests::ALL, view};
    use super::super::grid::{Part, Scale};
    use super::*;
    use pursuit_imaging::Image;
    use pursuit_vision::integral::IntegralImage;
    use pursuit_vision::warp::Affine;

    fn views(count: usize) -> Vec<[u8; SIDE * SIDE]> {
        let mut random = 7;
        (0..count).map(|_| std::array::from_fn(|_| draw(&mut random) as u8)).collect()
    }

    #[test]
    fn pairs_lie_in_line_and_differ() {
        let ferns = Ferns::new(&FernParams::default(), &mut 5);
        assert_eq!((ferns.pairs.len(), ferns.seen.len()), (130, 10 << 13));
        let side = SIDE as u16;
        for (i, &(a, b)) in ferns.pairs.iter().enumerate() {
            let ((ax, ay), (bx, by)) = ((a % side, a / side), (b % side, b / side));
            assert!(if i % 2 == 0 { ay == by && ax != bx } else { ax == bx && ay != by }, "{i}: {a} {b}");
            assert!(a < side * side && b < side * side);
        }
        assert!(ferns.used().windows(2).all(|w| w[0] < w[1]) && ferns.used().len() > 150);
        assert_ne!(ferns, Ferns::new(&FernParams::default(), &mut 6));
        assert!(ferns.fits(&FernParams::default()) && !ferns.fits(&FernParams { count: 9, ..FernParams::default() }));
    }

    #[test]
    fn posteriors_are_shares_of_what_was_seen() {
        let mut ferns = Ferns::new(&FernParams::default(), &mut 5);
        let views = views(2);
        let (mut a, mut b) = (Vec::new(), Vec::new());
        ferns.outcomes(&views[0], &mut a);
        ferns.outcomes(&views[1], &mut b);
        assert_eq!(a.len(), 10);
        for (fern, &outcome) in a.iter().enumerate() {
            assert_eq!(outcome as usize >> 13, fern);
            let bit = |k: usize| {
                let (p, q) = ferns.pairs[fern * 13 + k];
                views[0][usize::from(p)] > views[0][usize::from(q)]
            };
            assert!((0..13).all(|k| (outcome >> (12 - k) & 1 == 1) == bit(k)));
        }
        assert_eq!(ferns.sum(&a), 0);
        (0..3).for_each(|_| ferns.learn(&a, true));
        assert_eq!(ferns.sum(&a), ferns.threshold(1.0));
        ferns.learn(&a, false);
        let share = f64::from(ferns.sum(&a)) / f64::from(ferns.threshold(1.0));
        assert!((share - 0.75).abs() < 1e-3, "{share}");
        assert!(ferns.sum(&b) < ferns.threshold(0.2));
        assert_eq!(ferns.threshold(0.5), (u16::MAX / 10) * 5);
    }

    #[test]
    fn counts_never_overflow_and_keep_their_share() {
        let mut ferns = Ferns::new(&FernParams { count: 1, comparisons: 2, ..FernParams::default() }, &mut 5);
        (0..40_000).for_each(|_| ferns.learn(&[1], false));
        (0..200_000).for_each(|_| ferns.learn(&[1], true));
        let share = f64::from(ferns.sum(&[1])) / f64::from(ferns.threshold(1.0));
        assert!(share > 0.8 && share < 1.0, "{share}");
    }

    #[test]
    fn blocks_score_as_each_window_alone() {
        let image = Image::from_fn(150, 60, |x, y| (x * 37 + y * y * 11 + x * y * 3) as u8).unwrap();
        let mut integral = IntegralImage::new();
        integral.build(image.view());
        let scale = Scale { width: 40, height: 40, columns: 28, rows: 6 };
        let part = Part { left: 0, right: 28, top: 0, bottom: 6 };
        let mut cells = Cells::default();
        cells.take(&integral, (0, 0), &scale, &part, 1.0);
        for comparisons in [13, 8, 5] {
            let mut ferns = Ferns::new(&FernParams { comparisons, ..FernParams::default() }, &mut 5);
            let mut alone = [0; SIDE * SIDE];
            let mut outcomes = Vec::new();
            for i in 0..10 {
                view((&integral, (0, 0)), &scale.window(2 * i, i % 6), &Affine::IDENTITY, 1.0, &ALL, &mut alone);
                ferns.outcomes(&alone, &mut outcomes);
                ferns.learn(&outcomes, i % 3 != 0);
            }
            let mut seen = 0;
            for row in 0..6 {
                let mut sums = [0; BLOCK];
                ferns.score(&cells, row, 0, &mut sums);
                for (i, &sum) in sums.iter().take(28).enumerate() {
                    view((&integral, (0, 0)), &scale.window(i, row), &Affine::IDENTITY, 1.0, &ALL, &mut alone);
                    ferns.outcomes(&alone, &mut outcomes);
                    assert_eq!(sum, ferns.sum(&outcomes), "{comparisons}: {i}, {row}");
                    seen += usize::from(sum > 0);
                }
            }
            assert!(seen > 5);
        }
    }

    #[test]
    fn saved_ferns_return_and_senseless_are_refused() {
        let mut ferns = Ferns::new(&FernParams::default(), &mut 5);
        let mut outcomes = Vec::new();
        for (i, view) in views(20).iter().enumerate() {
            ferns.outcomes(view, &mut outcomes);
            ferns.learn(&outcomes, i % 2 == 0);
        }
        let saved = serde_json::to_value(&ferns).unwrap();
        assert_eq!(serde_json::from_value::<Ferns>(saved.clone()).unwrap(), ferns);
        for (key, value) in [
            ("count", 0.into()),
            ("comparisons", 15.into()),
            ("comparisons", 12.into()),
            ("seen", serde_json::json!([[10 << 13, 1, 1]])),
        ] {
            let mut bad = saved.clone();
            bad[key] = value;
            assert!(serde_json::from_value::<Ferns>(bad).is_err(), "{key}");
        }
        let mut bad = saved;
        bad["pairs"][3][1] = 400.into();
        assert!(serde_json::from_value::<Ferns>(bad).is_err());
    }
}
