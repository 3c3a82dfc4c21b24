use super::{Crowd, best_pairs, ratio};
use crate::EvaluationError;

/// What keeps a match of the frame before worth more than any overlap of another.
const KEPT: f64 = 1000.0;

/// The counts behind CLEAR MOT, in boxes.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Clear {
    /// True boxes that are found.
    pub matches: usize,
    /// True boxes that are not.
    pub misses: usize,
    /// Boxes said that are no true one's.
    pub false_alarms: usize,
    /// How often a true target is found by another than the one that found it last.
    pub switches: usize,
    /// The sum of the overlaps of matches.
    pub overlap: f64,
}

impl Clear {
    /// Multiple object tracking accuracy, ≤ 1; below 0 where mistakes outnumber the true boxes.
    pub fn mota(&self) -> f64 {
        let right = self.matches as f64 - self.false_alarms as f64 - self.switches as f64;
        ratio(right, (self.matches + self.misses) as f64)
    }

    /// Mean overlap of the matches, in `[0, 1]`; 0 of none.
    pub fn motp(&self) -> f64 {
        ratio(self.overlap, self.matches as f64)
    }
}

/// CLEAR MOT, where an overlap of at least `threshold` may be a match: frame by frame matches of the frame before are kept,
/// then overlaps are to be greatest.
///
/// # Errors
/// None that boxes can bring about.
pub fn clear(crowd: &Crowd, threshold: f64) -> Result<Clear, EvaluationError> {
    let mut counts = Clear::default();
    let targets = crowd.truth_counts.len();
    // Who found each true target last, and who did in the last frame in which there was something on both sides.
    let (mut last, mut before) = (vec![None; targets], vec![None; targets]);
    for frame in &crowd.frames {
        if frame.truth.is_empty() || frame.said.is_empty() {
            counts.misses += frame.truth.len();
            counts.false_alarms += frame.said.len();
            continue;
        }
        let gain = |truth: usize, said: usize| {
            let overlap = frame.overlap(truth, said);
            let kept = before[frame.truth[truth]] == Some(frame.said[said]);
            if overlap < threshold - f64::EPSILON { 0.0 } else { overlap + if kept { KEPT } else { 0.0 } }
        };
        let mut pairs = best_pairs(frame.truth.len(), frame.said.len(), gain)?;
        pairs.retain(|&(truth, said)| gain(truth, said) > f64::EPSILON);
        before.fill(None);
        for &(truth, said) in &pairs {
            let (target, by) = (frame.truth[truth], frame.said[said]);
            counts.switches += usize::from(last[target].is_some_and(|other| other != by));
            (last[target], before[target]) = (Some(by), Some(by));
            counts.overlap += frame.overlap(truth, said);
        }
        counts.matches += pairs.len();
        counts.misses += frame.truth.len() - pairs.len();
        counts.false_alarms += frame.said.len() - pairs.len();
    }
    Ok(counts)
}
