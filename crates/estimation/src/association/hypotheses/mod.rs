//! The best global hypothesis of track-oriented multiple hypothesis tracking (Kurien 1990; Blackman 2004): of every track one branch,
//! so that no two have a detection in common and their scores sum up to the most.
//!
//! As a graph, branches are vertices and what excludes each other is joined by an edge: a maximum weight independent set. It
//! is found exactly by branch and bound in small clusters of tracks, else improved step by step from a hypothesis that is known.

mod search;

use super::clusters::Clusters;
use crate::{EstimationError, Result};
use search::Search;

/// Passes over all tracks in which settled ones are put aside.
const MOST_REDUCTIONS: usize = 8;

/// A branch of a track.
#[derive(Debug, Clone, Copy)]
struct Branch {
    score: f64,
    /// Where its detections stand among those of all.
    from: usize,
    to: usize,
}

/// Finds the best global hypothesis. Tracks and their branches are told one after the other, then [`solve`](Self::solve) answers. Keeps
/// its memory from one problem to the next.
///
/// ```
/// use pursuit_estimation::association::GlobalHypothesis;
///
/// let mut best = GlobalHypothesis::new();
/// best.clear(2);
/// for scores in [[5.0, 3.0], [4.5, 0.5]] {
///     best.track();
///     best.branch(scores[0], [0]); // has detection 0
///     best.branch(scores[1], [1]); // has detection 1
///     best.branch(0.0, []); // was missed
/// }
/// // Both would have the first, but 3 and 4.5 are more than 5 and 0.5.
/// assert_eq!(best.solve(&[2, 2], 1000)?, [1, 0]);
/// # Ok::<(), pursuit_estimation::EstimationError>(())
/// ```
#[derive(Debug, Clone, Default)]
pub struct GlobalHypothesis {
    /// Where the branches of each track begin; those of the last one end where all end.
    tracks: Vec<usize>,
    branches: Vec<Branch>,
    detections: Vec<usize>,
    /// Of each detection how many tracks that are not settled want it; whether a settled one has it; and a track that counted it last.
    wanted: Vec<usize>,
    barred: Vec<bool>,
    counted: Vec<usize>,
    /// The branch chosen of each track, and whether that is settled.
    chosen: Vec<usize>,
    settled: Vec<bool>,
    clusters: Clusters,
    order: Vec<(usize, usize)>,
    search: Search,
}

impl GlobalHypothesis {
    /// A solver.
    pub fn new() -> Self {
        Self::default()
    }

    /// Starts a problem with so many detections, over all frames together.
    pub fn clear(&mut self, detections: usize) {
        self.tracks.clear();
        self.branches.clear();
        self.detections.clear();
        self.wanted.clear();
        self.wanted.resize(detections, 0);
    }

    /// A further track.
    pub fn track(&mut self) {
        self.tracks.push(self.branches.len());
    }

    /// A further branch of the last track, with its score (finite; more is better) and the detections it has taken.
    pub fn branch(&mut self, score: f64, taken: impl IntoIterator<Item = usize>) {
        let from = self.detections.len();
        self.detections.extend(taken);
        self.branches.push(Branch { score, from, to: self.detections.len() });
    }

    /// The branch of each track, by its number among the track's own. `first` is a hypothesis that is possible; what is found is never worse.
    /// `most_nodes` bounds the branches looked at in a cluster by branch and bound: beyond them the best hypothesis so far is improved
    /// by exchanging branches, and need not be the best of all.
    ///
    /// # Errors
    /// Where a score is not finite, a detection or branch does not exist, a track has no branch, or two branches of `first` have a detection in
    /// common.
    pub fn solve(&mut self, first: &[usize], most_nodes: usize) -> Result<&[usize]> {
        self.check(first)?;
        self.wanted.fill(0);
        self.barred.clear();
        self.barred.resize(self.wanted.len(), false);
        self.settled.clear();
        self.settled.resize(self.tracks.len(), false);
        self.counted.clear();
        self.counted.resize(self.wanted.len(), usize::MAX);
        for track in 0..self.tracks.len() {
            self.count(track, true);
        }
        for _ in 0..MOST_REDUCTIONS {
            if !self.settle() {
                break;
            }
        }
        self.join();
        self.search.owner.clear();
        self.search.owner.resize(self.wanted.len(), None);
        let order = std::mem::take(&mut self.order);
        for cluster in order.chunk_by(|a, b| a.0 == b.0) {
            self.cluster(cluster, most_nodes);
        }
        self.order = order;
        Ok(&self.chosen)
    }

    /// What the last hypothesis scores.
    pub fn score(&self) -> f64 {
        let own = |(track, chosen): (usize, &usize)| self.branches.get(self.tracks.get(track)? + chosen);
        self.chosen.iter().enumerate().filter_map(own).map(|branch| branch.score).sum()
    }

    fn check(&mut self, first: &[usize]) -> Result<()> {
        let (got, expected) = (first.len(), self.tracks.len());
        self.chosen.clear();
        if got != expected {
            return Err(EstimationError::Length { what: "branches of a hypothesis", got, expected });
        }
        let length = self.wanted.len();
        for branch in &self.branches {
            if !branch.score.is_finite() {
                return Err(EstimationError::NotFinite { what: "the score of a branch" });
            }
        }
        if let Some(index) = self.detections.iter().copied().find(|d| *d >= length) {
            return Err(EstimationError::Index { what: "detection", index, length });
        }
        self.counted.clear();
        self.counted.resize(length, usize::MAX);
        for (track, branch) in first.iter().enumerate() {
            let (from, to) = self.range(track);
            if from + branch >= to {
                return Err(EstimationError::Index { what: "branch", index: *branch, length: to - from });
            }
            let Branch { from, to, .. } = self.branches[from + branch];
            for detection in &self.detections[from..to] {
                let before = std::mem::replace(&mut self.counted[*detection], track);
                if before != usize::MAX && before != track {
                    return Err(EstimationError::Incompatible { what: "two branches of the first hypothesis" });
                }
            }
        }
        self.chosen.extend_from_slice(first);
        Ok(())
    }

    /// Where the branches of a track are.
    fn range(&self, track: usize) -> (usize, usize) {
        (self.tracks[track], self.tracks.get(track + 1).copied().unwrap_or(self.branches.len()))
    }

    fn of(&self, branch: usize) -> &[usize] {
        let Branch { from, to, .. } = self.branches[branch];
        &self.detections[from..to]
    }

    /// Whether no settled track has what a branch has.
    fn may_be(&self, branch: usize) -> bool {
        self.of(branch).iter().all(|detection| !self.barred[*detection])
    }

    /// Counts a track among those that want its detections, or no longer.
    fn count(&mut self, track: usize, more: bool) {
        let (from, to) = self.range(track);
        // Twice the track's number, and one more: what it counted when it came is not what it counts when it goes.
        let mark = 2 * track + usize::from(more);
        for branch in from..to {
            let Branch { from, to, .. } = self.branches[branch];
            for detection in &self.detections[from..to] {
                if std::mem::replace(&mut self.counted[*detection], mark) != mark {
                    let wanted = &mut self.wanted[*detection];
                    *wanted = if more { *wanted + 1 } else { wanted.saturating_sub(1) };
                }
            }
        }
    }

    /// Puts tracks aside that have one branch only, or whose best branch nobody else wants; whether there were any.
    fn settle(&mut self) -> bool {
        let mut any = false;
        for track in 0..self.tracks.len() {
            if self.settled[track] {
                continue;
            }
            let (from, to) = self.range(track);
            let mut best: Option<usize> = None;
            let mut several = false;
            for branch in (from..to).filter(|branch| self.may_be(*branch)) {
                several |= best.is_some();
                if best.is_none_or(|known| self.branches[branch].score > self.branches[known].score) {
                    best = Some(branch);
                }
            }
            let Some(best) = best else { continue };
            if several && self.of(best).iter().any(|detection| self.wanted[*detection] > 1) {
                continue;
            }
            self.count(track, false);
            let Branch { from: first, to: last, .. } = self.branches[best];
            self.detections[first..last].iter().for_each(|detection| self.barred[*detection] = true);
            (self.settled[track], self.chosen[track]) = (true, best - from);
            any = true;
        }
        any
    }

    /// Which of the tracks left share detections.
    fn join(&mut self) {
        let tracks = self.tracks.len();
        self.clusters.start(tracks + self.wanted.len());
        self.order.clear();
        for track in (0..tracks).filter(|track| !self.settled[*track]) {
            let (from, to) = (self.tracks[track], self.tracks.get(track + 1).copied().unwrap_or(self.branches.len()));
            for branch in self.branches[from..to].iter() {
                let taken = &self.detections[branch.from..branch.to];
                if taken.iter().all(|detection| !self.barred[*detection]) {
                    taken.iter().for_each(|detection| self.clusters.join(track, tracks + detection));
                }
            }
            self.order.push((0, track));
        }
        let clusters = &mut self.clusters;
        self.order.iter_mut().for_each(|(root, track)| *root = clusters.root(*track));
        self.order.sort_unstable();
    }

    fn cluster(&mut self, cluster: &[(usize, usize)], most_nodes: usize) {
        let mut search = std::mem::take(&mut self.search);
        search.fill(self, cluster);
        search.run(self, most_nodes);
        for (track, branch) in search.tracks.iter().zip(&search.best) {
            self.chosen[*track] = branch - self.tracks[*track];
        }
        self.search = search;
    }
}

#[cfg(test)]
mod tests;
