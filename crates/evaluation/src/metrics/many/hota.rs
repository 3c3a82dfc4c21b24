use super::{Crowd, best_pairs, ratio};
use crate::EvaluationError;
use crate::metrics::mean;
use std::collections::BTreeMap;

/// How many overlaps there are from which on a pair may be a match: .05, .1 … .95.
pub const THRESHOLDS: usize = 19;

const STEP: f64 = 0.05;

/// Higher order tracking accuracy and what it is made of, means over the thresholds, in `[0, 1]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Hota {
    /// HOTA: at each threshold the geometric mean of the next two.
    pub hota: f64,
    /// DetA: matches of all that is true or said.
    pub detection: f64,
    /// AssA: over matches, how much of either target's time the two are together.
    pub association: f64,
    /// LocA: the mean overlap of matches.
    pub localization: f64,
    /// HOTA at each threshold.
    pub by_threshold: [f64; THRESHOLDS],
    /// What the figures are made of.
    counts: HotaCounts,
}

/// Sums at each threshold, which add up over sequences.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct HotaCounts {
    truth: usize,
    said: usize,
    matches: [usize; THRESHOLDS],
    /// The overlaps of the matches.
    overlap: [f64; THRESHOLDS],
    /// Over matches, how much of either target's time the two are together.
    together: [f64; THRESHOLDS],
}

impl Hota {
    /// Of several sequences together, as TrackEval combines them: counts add up, AssA and LocA are weighted by matches.
    pub fn combined<'a>(parts: impl IntoIterator<Item = &'a Self>) -> Self {
        let mut sum = HotaCounts::default();
        for part in parts {
            sum.truth += part.counts.truth;
            sum.said += part.counts.said;
            for at in 0..THRESHOLDS {
                sum.matches[at] += part.counts.matches[at];
                sum.overlap[at] += part.counts.overlap[at];
                sum.together[at] += part.counts.together[at];
            }
        }
        Self::of(sum)
    }

    fn of(counts: HotaCounts) -> Self {
        let HotaCounts { truth, said, matches, overlap, together } = counts;
        let detection = matches.map(|found| ratio(found as f64, (truth + said - found) as f64));
        let association: [f64; THRESHOLDS] = std::array::from_fn(|at| ratio(together[at], matches[at] as f64));
        let localization: [f64; THRESHOLDS] =
            std::array::from_fn(|at| if matches[at] == 0 { 1.0 } else { overlap[at] / matches[at] as f64 });
        let by_threshold = std::array::from_fn(|at| (detection[at] * association[at]).sqrt());
        Self {
            hota: mean(&by_threshold),
            detection: mean(&detection),
            association: mean(&association),
            localization: mean(&localization),
            by_threshold,
            counts,
        }
    }
}

/// The sum of multiples that TrackEval takes, so that an overlap which equals a threshold is on the same side of it.
fn threshold(number: usize) -> f64 {
    STEP + number as f64 * STEP
}

/// HOTA. Pairs of a frame are matched so that targets which are together most, over the sequence, stay together.
///
/// # Errors
/// None that boxes can bring about.
pub fn hota(crowd: &Crowd) -> Result<Hota, EvaluationError> {
    let alignment = alignment(crowd);
    let (truth, said) = crowd.boxes();
    let mut sum = HotaCounts { truth, said, ..HotaCounts::default() };
    let mut by_pair: BTreeMap<(usize, usize), [usize; THRESHOLDS]> = BTreeMap::new();
    for frame in &crowd.frames {
        let gain = |i: usize, j: usize| {
            let overlap = frame.overlap(i, j);
            if overlap > 0.0 {
                alignment.get(&(frame.truth[i], frame.said[j])).copied().unwrap_or(0.0) * overlap
            } else {
                0.0
            }
        };
        for (i, j) in best_pairs(frame.truth.len(), frame.said.len(), gain)? {
            let overlap = frame.overlap(i, j);
            if overlap < threshold(0) - f64::EPSILON {
                continue;
            }
            let pair = by_pair.entry((frame.truth[i], frame.said[j])).or_default();
            for at in (0..THRESHOLDS).filter(|&at| overlap >= threshold(at) - f64::EPSILON) {
                sum.matches[at] += 1;
                sum.overlap[at] += overlap;
                pair[at] += 1;
            }
        }
    }
    for (pair, counts) in &by_pair {
        for (at, together) in counts.iter().enumerate() {
            let together = *together as f64;
            sum.together[at] += together * ratio(together, either(crowd, *pair) - together);
        }
    }
    Ok(Hota::of(sum))
}

/// Boxes of the true target of a pair and of the one said, counted together.
fn either(crowd: &Crowd, (truth, said): (usize, usize)) -> f64 {
    (crowd.truth_counts[truth] + crowd.said_counts[said]) as f64
}

/// Of every pair of targets that meet, the part of their time that they are together; a box that overlaps several counts for
/// each in part.
fn alignment(crowd: &Crowd) -> BTreeMap<(usize, usize), f64> {
    let mut together: BTreeMap<(usize, usize), f64> = BTreeMap::new();
    for frame in &crowd.frames {
        let of_truth: Vec<f64> =
            (0..frame.truth.len()).map(|i| (0..frame.said.len()).map(|j| frame.overlap(i, j)).sum()).collect();
        let of_said: Vec<f64> =
            (0..frame.said.len()).map(|j| (0..frame.truth.len()).map(|i| frame.overlap(i, j)).sum()).collect();
        for (i, &truth) in frame.truth.iter().enumerate() {
            for (j, &said) in frame.said.iter().enumerate() {
                let overlap = frame.overlap(i, j);
                let all = of_truth[i] + of_said[j] - overlap;
                if overlap > 0.0 && all > f64::EPSILON {
                    *together.entry((truth, said)).or_default() += overlap / all;
                }
            }
        }
    }
    together.into_iter().map(|(pair, t)| (pair, t / (either(crowd, pair) - t))).collect()
}
