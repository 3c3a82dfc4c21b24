//! Measures of many targets: CLEAR MOT (Bernardin and Stiefelhagen 2008), IDF1 (Ristani et al. 2016) and HOTA (Luiten et al.
//! 2021), as TrackEval computes them.
//!
//! ```
//! use pursuit_evaluation::metrics::many::{Crowd, Labelled, clear, hota, identity};
//! use pursuit_geometry::BBox;
//!
//! let at = |frame, target, x| Labelled { frame, target, bbox: BBox::from_ltwh(x, 0.0, 10.0, 20.0) };
//! let truth = [at(0, 1, 0.0), at(1, 1, 5.0), at(2, 1, 10.0)];
//! let said = [at(0, 7, 0.0), at(1, 7, 5.0), at(2, 8, 10.0)];
//! let crowd = Crowd::new(&truth, &said)?;
//! assert_eq!(clear(&crowd, 0.5)?.switches, 1);
//! assert_eq!(identity(&crowd, 0.5)?.idf1(), 2.0 / 3.0);
//! assert!(hota(&crowd)?.hota < 1.0);
//! # Ok::<(), pursuit_evaluation::EvaluationError>(())
//! ```

mod clear;
mod hota;
mod identity;

pub use clear::{Clear, Match, clear, clear_told};
pub use hota::{Hota, THRESHOLDS, hota};
pub use identity::{Identity, identity};

use crate::EvaluationError;
use pursuit_estimation::association::Assignment;
use pursuit_geometry::BBox;
use std::collections::{BTreeMap, BTreeSet};

/// A box of one target in one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Labelled {
    /// The frame.
    pub frame: u64,
    /// The target's number.
    pub target: u64,
    /// Where it is, pixels.
    pub bbox: BBox,
}

/// What is true and what is said of one sequence, frame by frame, with all overlaps.
#[derive(Debug, Clone)]
pub struct Crowd {
    frames: Vec<CrowdFrame>,
    /// How many boxes each true target, and each one said, has.
    truth_counts: Vec<usize>,
    said_counts: Vec<usize>,
    /// What the targets are called.
    truth_ids: Vec<u64>,
    said_ids: Vec<u64>,
}

/// One frame: the targets, numbered from 0, and their overlaps, true target by true target.
#[derive(Debug, Clone, Default)]
struct CrowdFrame {
    number: u64,
    truth: Vec<usize>,
    said: Vec<usize>,
    overlaps: Vec<f64>,
}

impl CrowdFrame {
    fn overlap(&self, truth: usize, said: usize) -> f64 {
        self.overlaps[truth * self.said.len() + said]
    }
}

impl Crowd {
    /// Of boxes in any order.
    ///
    /// # Errors
    /// A target that has two boxes in one frame.
    pub fn new(truth: &[Labelled], said: &[Labelled]) -> Result<Self, EvaluationError> {
        let mut frames: BTreeMap<u64, [Vec<(usize, BBox)>; 2]> = BTreeMap::new();
        let mut counts = [Vec::new(), Vec::new()];
        let mut ids = [Vec::new(), Vec::new()];
        for (side, boxes) in [truth, said].into_iter().enumerate() {
            let numbers: BTreeSet<u64> = boxes.iter().map(|b| b.target).collect();
            ids[side] = numbers.iter().copied().collect();
            let numbers: BTreeMap<u64, usize> = numbers.into_iter().zip(0..).collect();
            counts[side].resize(numbers.len(), 0);
            for b in boxes {
                let number = numbers.get(&b.target).copied().unwrap_or_default();
                let here = &mut frames.entry(b.frame).or_default()[side];
                if here.iter().any(|(other, _)| *other == number) {
                    let whose = if side == 0 { "true target" } else { "target" };
                    let (target, frame) = (b.target, b.frame);
                    return Err(EvaluationError::Option(format!("{whose} {target} has two boxes in frame {frame}")));
                }
                here.push((number, b.bbox));
                counts[side][number] += 1;
            }
        }
        let frames = frames.into_iter().map(|(number, [truth, said])| CrowdFrame {
            number,
            overlaps: truth.iter().flat_map(|(_, a)| said.iter().map(move |(_, b)| overlap(a, b))).collect(),
            truth: truth.into_iter().map(|(number, _)| number).collect(),
            said: said.into_iter().map(|(number, _)| number).collect(),
        });
        let frames = frames.collect();
        let ([truth_counts, said_counts], [truth_ids, said_ids]) = (counts, ids);
        Ok(Self { frames, truth_counts, said_counts, truth_ids, said_ids })
    }

    /// How many boxes are true, and how many are said.
    pub fn boxes(&self) -> (usize, usize) {
        (self.truth_counts.iter().sum(), self.said_counts.iter().sum())
    }
}

/// The overlap of two boxes (intersection over union) by the very operations of TrackEval: with thresholds at round numbers
/// and boxes of few decimals, the last digit decides.
pub(crate) fn overlap(a: &BBox, b: &BBox) -> f64 {
    let (common, area_a, area_b) = common(a, b);
    let union = area_a + area_b - common;
    if area_a <= f64::EPSILON || area_b <= f64::EPSILON || union <= f64::EPSILON { 0.0 } else { common / union }
}

/// The part of `a` that lies inside `b`.
pub(crate) fn inside(a: &BBox, b: &BBox) -> f64 {
    let (common, area, _) = common(a, b);
    if area <= f64::EPSILON { 0.0 } else { common / area }
}

fn common(a: &BBox, b: &BBox) -> (f64, f64, f64) {
    let corners = |b: &BBox| [b.left(), b.top(), b.left() + b.width(), b.top() + b.height()];
    let ([al, at, ar, ab], [bl, bt, br, bb]) = (corners(a), corners(b));
    let across = (ar.min(br) - al.max(bl)).max(0.0);
    let down = (ab.min(bb) - at.max(bt)).max(0.0);
    (across * down, (ar - al) * (ab - at), (br - bl) * (bb - bt))
}

/// Pairs of rows and columns with the greatest sum of `gain`, which is ≥ 0.
pub(crate) fn best_pairs(
    rows: usize,
    columns: usize,
    gain: impl Fn(usize, usize) -> f64,
) -> Result<Vec<(usize, usize)>, EvaluationError> {
    let mut solver = Assignment::new();
    let found = solver.solve(rows, columns, |row, column| -gain(row, column), |_| 0.0);
    let found = found.map_err(|e| EvaluationError::Option(e.to_string()))?;
    Ok(found.iter().enumerate().filter_map(|(row, column)| Some((row, (*column)?))).collect())
}

fn ratio(part: f64, whole: f64) -> f64 {
    part / whole.max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(frame: u64, target: u64, x: f64) -> Labelled {
        Labelled { frame, target, bbox: BBox::from_ltwh(x, 0.0, 10.0, 20.0) }
    }

    fn walk(target: u64, from: f64) -> Vec<Labelled> {
        (0..10).map(|k| at(k, target, from + k as f64)).collect()
    }

    #[test]
    fn what_is_right_is_right_by_every_measure() {
        let truth = [walk(1, 0.0), walk(2, 100.0)].concat();
        let said = [walk(40, 100.0), walk(30, 0.0)].concat();
        let crowd = Crowd::new(&truth, &said).unwrap();
        let (clear, identity, hota) =
            (clear(&crowd, 0.5).unwrap(), identity(&crowd, 0.5).unwrap(), hota(&crowd).unwrap());
        assert_eq!((clear.mota(), clear.motp(), clear.switches), (1.0, 1.0, 0));
        assert_eq!(identity.idf1(), 1.0);
        assert_eq!((hota.hota, hota.detection, hota.association), (1.0, 1.0, 1.0));
    }

    #[test]
    fn misses_false_alarms_and_switches_are_counted() {
        let truth = [walk(1, 0.0), walk(2, 100.0)].concat();
        // The first is called otherwise from frame 5 on, the second is said twice in the wrong place.
        let mut said: Vec<Labelled> = walk(1, 0.0);
        said[5..].iter_mut().for_each(|b| b.target = 9);
        said.extend([at(0, 5, 300.0), at(1, 5, 300.0)]);
        let crowd = Crowd::new(&truth, &said).unwrap();
        let clear = clear(&crowd, 0.5).unwrap();
        assert_eq!((clear.matches, clear.misses, clear.false_alarms, clear.switches), (10, 10, 2, 1));
        assert_eq!(clear.mota(), (10.0 - 2.0 - 1.0) / 20.0);
        let identity = identity(&crowd, 0.5).unwrap();
        assert_eq!((identity.matches, identity.misses, identity.false_alarms), (5, 15, 7));
        let hota = hota(&crowd).unwrap();
        assert!((hota.detection - 10.0 / 22.0).abs() < 1e-12 && (hota.association - 0.5).abs() < 1e-12, "{hota:?}");
    }

    #[test]
    fn parts_of_targets_found_and_breaks_are_counted() {
        let truth = [walk(1, 0.0), walk(2, 100.0), walk(3, 200.0)].concat();
        let said: Vec<Labelled> = [walk(1, 0.0), walk(2, 100.0)].concat();
        // The second is missed twice, for two frames.
        let said: Vec<Labelled> =
            said.into_iter().filter(|b| b.target == 1 || ![2, 3, 6, 7].contains(&b.frame)).collect();
        let crowd = Crowd::new(&truth, &said).unwrap();
        let mut told = 0;
        let counts = clear_told(&crowd, 0.5, |m| told += usize::from(m.truth == m.said)).unwrap();
        assert_eq!((counts.mostly_tracked, counts.partly_tracked, counts.mostly_lost), (1, 1, 1));
        assert_eq!((counts.fragments, counts.matches, told), (2, 16, 16));
    }

    #[test]
    fn figures_of_sequences_add_up() {
        let truth = [walk(1, 0.0), walk(2, 100.0)].concat();
        let crowds = [&walk(1, 0.0)[..], &truth, &[]].map(|said| Crowd::new(&truth, said).unwrap());
        let each = crowds.each_ref().map(|c| hota(c).unwrap());
        let whole = Hota::combined(&each);
        assert!((whole.detection - 30.0 / 60.0).abs() < 1e-12 && whole.association == 1.0, "{whole:?}");
        assert_eq!(Hota::combined(&each[1..2]), each[1]);
        let each = crowds.each_ref().map(|c| clear(c, 0.5).unwrap());
        let whole = Clear::combined(&each);
        assert_eq!((whole.matches, whole.misses, whole.mostly_lost, whole.mostly_tracked), (30, 30, 3, 3));
        let whole = Identity::combined(&crowds.each_ref().map(|c| identity(c, 0.5).unwrap()));
        assert_eq!((whole.matches, whole.misses), (30, 30));
    }

    #[test]
    fn duplicate_boxes_of_a_target_are_refused() {
        let crowd = Crowd::new(&walk(1, 0.0), &[]).unwrap();
        assert_eq!((clear(&crowd, 0.5).unwrap().mota(), hota(&crowd).unwrap().hota), (0.0, 0.0));
        let crowd = Crowd::new(&[], &walk(1, 0.0)).unwrap();
        assert_eq!((clear(&crowd, 0.5).unwrap().false_alarms, identity(&crowd, 0.5).unwrap().idf1()), (10, 0.0));
        let twice = Crowd::new(&[at(3, 1, 0.0), at(3, 1, 5.0)], &[]).unwrap_err();
        assert!(twice.to_string().contains("true target 1 has two boxes in frame 3"), "{twice}");
    }
}
