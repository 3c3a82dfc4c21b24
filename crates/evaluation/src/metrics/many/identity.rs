use super::{Crowd, best_pairs, ratio};
use crate::EvaluationError;

/// The counts behind IDF1, in boxes, when every true target is told to be one of those said, for the whole sequence.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Identity {
    /// True boxes that theirs finds.
    pub matches: usize,
    /// True boxes that it does not.
    pub misses: usize,
    /// Boxes said that find nothing of theirs.
    pub false_alarms: usize,
}

impl Identity {
    /// The harmonic mean of the next two, in `[0, 1]`.
    pub fn idf1(&self) -> f64 {
        let mistakes = 0.5 * (self.misses + self.false_alarms) as f64;
        ratio(self.matches as f64, self.matches as f64 + mistakes)
    }

    /// The part of the true boxes that is found.
    pub fn recall(&self) -> f64 {
        ratio(self.matches as f64, (self.matches + self.misses) as f64)
    }

    /// The part of the boxes said that is right.
    pub fn precision(&self) -> f64 {
        ratio(self.matches as f64, (self.matches + self.false_alarms) as f64)
    }
}

/// IDF1, where an overlap of at least `threshold` may be a match: the pairing of targets with the most matches.
///
/// # Errors
/// None that boxes can bring about.
pub fn identity(crowd: &Crowd, threshold: f64) -> Result<Identity, EvaluationError> {
    let (rows, columns) = (crowd.truth_counts.len(), crowd.said_counts.len());
    let mut possible = vec![0usize; rows * columns];
    for frame in &crowd.frames {
        for (i, &truth) in frame.truth.iter().enumerate() {
            for (j, &said) in frame.said.iter().enumerate() {
                possible[truth * columns + said] += usize::from(frame.overlap(i, j) >= threshold);
            }
        }
    }
    let together = |truth: usize, said: usize| possible[truth * columns + said];
    let pairs = best_pairs(rows, columns, |truth, said| together(truth, said) as f64)?;
    let matches = pairs.into_iter().map(|(truth, said)| together(truth, said)).sum();
    let (truth, said) = crowd.boxes();
    Ok(Identity { matches, misses: truth - matches, false_alarms: said - matches })
}
