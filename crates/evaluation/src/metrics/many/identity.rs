use super::{Crowd, best_pairs, ratio};
use crate::EvaluationError;
use std::collections::{BTreeMap, BTreeSet};

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

    /// The counts of several sequences together.
    pub fn combined<'a>(parts: impl IntoIterator<Item = &'a Self>) -> Self {
        parts.into_iter().fold(Self::default(), |a, b| Self {
            matches: a.matches + b.matches,
            misses: a.misses + b.misses,
            false_alarms: a.false_alarms + b.false_alarms,
        })
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
    // In how many frames a true target and one said may be matched; pairs that never meet have no entry.
    let mut together: BTreeMap<(usize, usize), usize> = BTreeMap::new();
    for frame in &crowd.frames {
        for (i, &truth) in frame.truth.iter().enumerate() {
            for (j, &said) in frame.said.iter().enumerate() {
                if frame.overlap(i, j) >= threshold {
                    *together.entry((truth, said)).or_default() += 1;
                }
            }
        }
    }
    let mut matches = 0;
    for group in groups(&together) {
        matches += most_matches(&group)?;
    }
    let (truth, said) = crowd.boxes();
    Ok(Identity { matches, misses: truth - matches, false_alarms: said - matches })
}

/// A true target, one said, and in how many frames they may be matched.
type Meeting = (usize, usize, usize);

/// The meetings in groups that share no target: each can be solved alone.
fn groups(together: &BTreeMap<(usize, usize), usize>) -> Vec<Vec<Meeting>> {
    let mut group_of_truth: BTreeMap<usize, usize> = BTreeMap::new();
    let mut group_of_said: BTreeMap<usize, usize> = BTreeMap::new();
    let mut groups: Vec<Vec<Meeting>> = Vec::new();
    for (&(truth, said), &count) in together {
        let own = group_of_truth.get(&truth).copied();
        let theirs = group_of_said.get(&said).copied();
        let group = match (own, theirs) {
            (Some(a), Some(b)) if a != b => {
                // The smaller group moves into the larger one.
                let (into, from) = if groups[a].len() >= groups[b].len() { (a, b) } else { (b, a) };
                let moved = std::mem::take(&mut groups[from]);
                for (truth, said, _) in &moved {
                    group_of_truth.insert(*truth, into);
                    group_of_said.insert(*said, into);
                }
                groups[into].extend(moved);
                into
            }
            (Some(known), _) | (_, Some(known)) => known,
            (None, None) => {
                groups.push(Vec::new());
                groups.len() - 1
            }
        };
        groups[group].push((truth, said, count));
        group_of_truth.insert(truth, group);
        group_of_said.insert(said, group);
    }
    groups.retain(|group| !group.is_empty());
    groups
}

/// The matches of the best pairing of one group.
fn most_matches(group: &[Meeting]) -> Result<usize, EvaluationError> {
    if let [(_, _, count)] = group {
        return Ok(*count);
    }
    let places = |of: fn(&Meeting) -> usize| -> BTreeMap<usize, usize> {
        let sorted: BTreeSet<usize> = group.iter().map(of).collect();
        sorted.into_iter().zip(0..).collect()
    };
    let (rows, columns) = (places(|m| m.0), places(|m| m.1));
    let counts: BTreeMap<(usize, usize), usize> =
        group.iter().filter_map(|(t, s, n)| Some(((*rows.get(t)?, *columns.get(s)?), *n))).collect();
    let count = |row: usize, column: usize| counts.get(&(row, column)).copied().unwrap_or(0);
    let pairs = best_pairs(rows.len(), columns.len(), |row, column| count(row, column) as f64)?;
    Ok(pairs.into_iter().map(|(row, column)| count(row, column)).sum())
}
