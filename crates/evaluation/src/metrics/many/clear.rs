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
    /// How often a true target is found again after it was not.
    pub fragments: usize,
    /// True targets found in more than 80 % of their boxes.
    pub mostly_tracked: usize,
    /// True targets found in at least 20 % of their boxes, and not mostly.
    pub partly_tracked: usize,
    /// The other true targets.
    pub mostly_lost: usize,
}

/// One match of [`clear_told`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Match {
    /// The frame.
    pub frame: u64,
    /// The true target.
    pub truth: u64,
    /// Who finds it.
    pub said: u64,
    /// Who found it last, where that was another.
    pub switched_from: Option<u64>,
}

impl Clear {
    /// Multiple object tracking accuracy, ≤ 1; below 0 where mistakes outnumber the true boxes.
    pub fn mota(&self) -> f64 {
        let right = self.matches as f64 - self.false_alarms as f64 - self.switches as f64;
        ratio(right, (self.matches + self.misses) as f64)
    }

    /// The counts of several sequences together.
    pub fn combined<'a>(parts: impl IntoIterator<Item = &'a Self>) -> Self {
        parts.into_iter().fold(Self::default(), |a, b| Self {
            matches: a.matches + b.matches,
            misses: a.misses + b.misses,
            false_alarms: a.false_alarms + b.false_alarms,
            switches: a.switches + b.switches,
            overlap: a.overlap + b.overlap,
            fragments: a.fragments + b.fragments,
            mostly_tracked: a.mostly_tracked + b.mostly_tracked,
            partly_tracked: a.partly_tracked + b.partly_tracked,
            mostly_lost: a.mostly_lost + b.mostly_lost,
        })
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
    clear_told(crowd, threshold, |_| ())
}

/// What is known of each true target while the frames are gone through.
struct Follow {
    /// Who found it last.
    last: Vec<Option<usize>>,
    /// Who did in the last frame in which there was something on both sides.
    before: Vec<Option<usize>>,
    /// In how many frames it was found.
    found: Vec<usize>,
    /// How often its being found began.
    beginnings: Vec<usize>,
}

/// As [`clear`], and tells each match.
///
/// # Errors
/// None that boxes can bring about.
pub fn clear_told(crowd: &Crowd, threshold: f64, mut tell: impl FnMut(Match)) -> Result<Clear, EvaluationError> {
    let mut counts = Clear::default();
    let targets = crowd.truth_counts.len();
    let mut follow = Follow {
        last: vec![None; targets],
        before: vec![None; targets],
        found: vec![0; targets],
        beginnings: vec![0; targets],
    };
    for frame in &crowd.frames {
        if frame.truth.is_empty() || frame.said.is_empty() {
            counts.misses += frame.truth.len();
            counts.false_alarms += frame.said.len();
            continue;
        }
        let gain = |truth: usize, said: usize| {
            let overlap = frame.overlap(truth, said);
            let kept = follow.before[frame.truth[truth]] == Some(frame.said[said]);
            if overlap < threshold - f64::EPSILON { 0.0 } else { overlap + if kept { KEPT } else { 0.0 } }
        };
        let mut pairs = best_pairs(frame.truth.len(), frame.said.len(), gain)?;
        pairs.retain(|&(truth, said)| gain(truth, said) > f64::EPSILON);
        for &(truth, said) in &pairs {
            let (target, by) = (frame.truth[truth], frame.said[said]);
            let other = follow.last[target].replace(by).filter(|other| *other != by);
            counts.switches += usize::from(other.is_some());
            counts.overlap += frame.overlap(truth, said);
            follow.found[target] += 1;
            follow.beginnings[target] += usize::from(follow.before[target].is_none());
            let switched_from = other.map(|other| crowd.said_ids[other]);
            let (truth, said) = (crowd.truth_ids[target], crowd.said_ids[by]);
            tell(Match { frame: frame.number, truth, said, switched_from });
        }
        follow.before.fill(None);
        pairs.iter().for_each(|&(truth, said)| follow.before[frame.truth[truth]] = Some(frame.said[said]));
        counts.matches += pairs.len();
        counts.misses += frame.truth.len() - pairs.len();
        counts.false_alarms += frame.said.len() - pairs.len();
    }
    tracked(crowd, &follow, &mut counts);
    Ok(counts)
}

/// How much of their time the true targets are found, and how often that broke off.
fn tracked(crowd: &Crowd, follow: &Follow, counts: &mut Clear) {
    counts.fragments = follow.beginnings.iter().map(|begun| begun.saturating_sub(1)).sum();
    for (found, boxes) in follow.found.iter().zip(&crowd.truth_counts) {
        match ratio(*found as f64, *boxes as f64) {
            part if part > 0.8 => counts.mostly_tracked += 1,
            part if part >= 0.2 => counts.partly_tracked += 1,
            _ => counts.mostly_lost += 1,
        }
    }
}
