use super::{Crowd, best_pairs, ratio};
use crate::EvaluationError;
use crate::metrics::mean;

/// How many overlaps there are from which on a pair may be a match: .05, .1 … .95.
pub const THRESHOLDS: usize = 19;

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
}

fn threshold(number: usize) -> f64 {
    0.05 * (number + 1) as f64
}

/// HOTA. Pairs of a frame are matched so that targets which are together most, over the sequence, stay together.
///
/// # Errors
/// None that boxes can bring about.
pub fn hota(crowd: &Crowd) -> Result<Hota, EvaluationError> {
    let columns = crowd.said_counts.len();
    let alignment = alignment(crowd);
    let mut counts = vec![[0usize; THRESHOLDS]; alignment.len()];
    let (mut matches, mut overlaps) = ([0usize; THRESHOLDS], [0.0; THRESHOLDS]);
    for frame in &crowd.frames {
        let pair = |i: usize, j: usize| frame.truth[i] * columns + frame.said[j];
        let gain = |i: usize, j: usize| alignment[pair(i, j)] * frame.overlap(i, j);
        for (i, j) in best_pairs(frame.truth.len(), frame.said.len(), gain)? {
            let overlap = frame.overlap(i, j);
            for at in (0..THRESHOLDS).filter(|&at| overlap >= threshold(at) - f64::EPSILON) {
                matches[at] += 1;
                overlaps[at] += overlap;
                counts[pair(i, j)][at] += 1;
            }
        }
    }
    let (truth, said) = crowd.boxes();
    let detection = matches.map(|found| ratio(found as f64, (truth + said - found) as f64));
    let association: [f64; THRESHOLDS] = std::array::from_fn(|at| {
        let together = counts.iter().enumerate().filter(|(_, together)| together[at] > 0).map(|(pair, together)| {
            let together = together[at] as f64;
            together * ratio(together, either(crowd, pair) - together)
        });
        ratio(together.sum(), matches[at] as f64)
    });
    let localization: [f64; THRESHOLDS] =
        std::array::from_fn(|at| if matches[at] == 0 { 1.0 } else { overlaps[at] / matches[at] as f64 });
    let by_threshold = std::array::from_fn(|at| (detection[at] * association[at]).sqrt());
    Ok(Hota {
        hota: mean(&by_threshold),
        detection: mean(&detection),
        association: mean(&association),
        localization: mean(&localization),
        by_threshold,
    })
}

/// Boxes of the true target of a pair and of the one said, counted together.
fn either(crowd: &Crowd, pair: usize) -> f64 {
    let columns = crowd.said_counts.len();
    (crowd.truth_counts[pair / columns] + crowd.said_counts[pair % columns]) as f64
}

/// Of every pair of targets, the part of their time that they are together; a box that overlaps several counts for each in part.
fn alignment(crowd: &Crowd) -> Vec<f64> {
    let columns = crowd.said_counts.len();
    let mut together = vec![0.0; crowd.truth_counts.len() * columns];
    for frame in &crowd.frames {
        let of_truth: Vec<f64> =
            (0..frame.truth.len()).map(|i| (0..frame.said.len()).map(|j| frame.overlap(i, j)).sum()).collect();
        let of_said: Vec<f64> =
            (0..frame.said.len()).map(|j| (0..frame.truth.len()).map(|i| frame.overlap(i, j)).sum()).collect();
        for (i, &truth) in frame.truth.iter().enumerate() {
            for (j, &said) in frame.said.iter().enumerate() {
                let overlap = frame.overlap(i, j);
                let all = of_truth[i] + of_said[j] - overlap;
                if all > f64::EPSILON {
                    together[truth * columns + said] += overlap / all;
                }
            }
        }
    }
    together.iter().enumerate().map(|(pair, &t)| if t > 0.0 { t / (either(crowd, pair) - t) } else { 0.0 }).collect()
}
