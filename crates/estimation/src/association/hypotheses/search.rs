//! The search in one cluster: branch and bound, then exchanges.

use super::GlobalHypothesis;

/// The most tracks of one cluster that are searched through: the search goes as deep.
const LARGEST_CLUSTER: usize = 500;

/// Passes over all tracks in which a hypothesis is improved step by step.
const MOST_IMPROVEMENTS: usize = 10;

/// Sums that differ by less are equal.
const EQUAL: f64 = 1e-9;

/// One cluster's search.
#[derive(Debug, Clone, Default)]
pub(super) struct Search {
    /// Tracks, the most decisive first, and the most that those from each on can add.
    pub tracks: Vec<usize>,
    bounds: Vec<f64>,
    /// Branches of each track that may be, the best first, and where those of each track begin.
    choices: Vec<usize>,
    starts: Vec<usize>,
    /// Of each detection, who has it.
    pub owner: Vec<Option<usize>>,
    /// The branches of the hypothesis looked at, and of the best one so far, in the order of `tracks`.
    current: Vec<usize>,
    pub best: Vec<usize>,
    best_score: f64,
    left: usize,
    losers: Vec<usize>,
    decisive: Vec<(f64, usize)>,
}

impl Search {
    pub fn fill(&mut self, problem: &GlobalHypothesis, cluster: &[(usize, usize)]) {
        let score = |branch: &usize| problem.branches[*branch].score;
        self.tracks.clear();
        self.tracks.extend(cluster.iter().map(|(_, track)| *track));
        // What loses most by its second best comes first: the others give way to it.
        self.decisive.clear();
        for &track in &self.tracks {
            let (from, to) = problem.range(track);
            let (mut best, mut second) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
            for score in (from..to).filter(|b| problem.may_be(*b)).map(|b| score(&b)) {
                (best, second) = if score > best { (score, best) } else { (best, second.max(score)) };
            }
            self.decisive.push((second - best, track));
        }
        self.decisive.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        self.tracks.clear();
        self.tracks.extend(self.decisive.iter().map(|(_, track)| *track));
        self.choices.clear();
        self.starts.clear();
        for &track in &self.tracks {
            let (from, to) = problem.range(track);
            let start = self.choices.len();
            self.starts.push(start);
            self.choices.extend((from..to).filter(|branch| problem.may_be(*branch)));
            self.choices[start..].sort_unstable_by(|a, b| score(b).total_cmp(&score(a)).then(a.cmp(b)));
        }
        self.starts.push(self.choices.len());
        self.bounds.clear();
        self.bounds.resize(self.tracks.len() + 1, 0.0);
        for at in (0..self.tracks.len()).rev() {
            self.bounds[at] = self.bounds[at + 1] + score(&self.choices[self.starts[at]]);
        }
        self.best.clear();
        self.best.extend(self.tracks.iter().map(|track| problem.tracks[*track] + problem.chosen[*track]));
        self.current.clear();
        self.current.resize(self.tracks.len(), 0);
    }

    /// Finds the best hypothesis of the cluster, or improves the one that is known.
    pub fn run(&mut self, problem: &GlobalHypothesis, most_nodes: usize) {
        self.best_score = self.best.iter().map(|branch| problem.branches[*branch].score).sum();
        self.left = most_nodes;
        let all = self.tracks.len() <= LARGEST_CLUSTER && self.below(problem, 0, 0.0).is_some();
        if !all {
            self.improve(problem);
        }
    }

    /// Looks through the branches of the tracks from `at` on, given those before, which score so much; `None` where that is too many.
    fn below(&mut self, problem: &GlobalHypothesis, at: usize, score: f64) -> Option<()> {
        if at == self.tracks.len() {
            if score > self.best_score + EQUAL {
                self.best_score = score;
                self.best.copy_from_slice(&self.current);
            }
            return Some(());
        }
        for choice in self.starts[at]..self.starts[at + 1] {
            let branch = self.choices[choice];
            let with = score + problem.branches[branch].score;
            if with + self.bounds[at + 1] <= self.best_score + EQUAL {
                // The branches behind it score less.
                break;
            }
            let taken = problem.of(branch);
            if taken.iter().any(|detection| self.owner[*detection].is_some()) {
                continue;
            }
            self.left = self.left.checked_sub(1)?;
            taken.iter().for_each(|detection| self.owner[*detection] = Some(at));
            self.current[at] = branch;
            let looked = self.below(problem, at + 1, with);
            taken.iter().for_each(|detection| self.owner[*detection] = None);
            looked?;
        }
        Some(())
    }

    /// Sets who has what by the branches given, and nobody anything else of the cluster.
    fn owner_of(&mut self, problem: &GlobalHypothesis, branches: &[usize]) {
        for branch in &self.choices {
            problem.of(*branch).iter().for_each(|detection| self.owner[*detection] = None);
        }
        for (at, branch) in branches.iter().enumerate() {
            problem.of(*branch).iter().for_each(|detection| self.owner[*detection] = Some(at));
        }
    }

    /// Improves the best hypothesis by giving a track another branch, and those that lose a detection by it the best that is left.
    fn improve(&mut self, problem: &GlobalHypothesis) {
        let best = std::mem::take(&mut self.best);
        self.owner_of(problem, &best);
        self.best = best;
        for _ in 0..MOST_IMPROVEMENTS {
            let mut any = false;
            for at in 0..self.tracks.len() {
                for choice in self.starts[at]..self.starts[at + 1] {
                    any |= self.exchange(problem, at, self.choices[choice]);
                }
            }
            if !any {
                break;
            }
        }
        self.owner_of(problem, &[]);
    }

    /// Gives a track this branch where the whole gains by it.
    fn exchange(&mut self, problem: &GlobalHypothesis, at: usize, branch: usize) -> bool {
        let score = |branch: usize| problem.branches[branch].score;
        let before = self.best[at];
        if branch == before {
            return false;
        }
        let mut losers = std::mem::take(&mut self.losers);
        losers.clear();
        for detection in problem.of(branch) {
            let other = self.owner[*detection].filter(|other| *other != at && !losers.contains(other));
            losers.extend(other);
        }
        let mut gain = score(branch) - score(before);
        // No loser gains more than its best branch has more than its own.
        let most: f64 = losers.iter().map(|l| score(self.choices[self.starts[*l]]) - score(self.best[*l])).sum();
        let mut good = gain + most > EQUAL;
        if good {
            self.current.clear();
            self.current.extend(losers.iter().map(|loser| self.best[*loser]));
            self.set(problem, before, None);
            losers.iter().for_each(|loser| self.set(problem, self.best[*loser], None));
            self.set(problem, branch, Some(at));
            let mut placed = 0;
            for &loser in &losers {
                let own = &self.choices[self.starts[loser]..self.starts[loser + 1]];
                let free = |b: &&usize| problem.of(**b).iter().all(|detection| self.owner[*detection].is_none());
                let Some(&next) = own.iter().find(free) else { break };
                gain += score(next) - score(self.best[loser]);
                self.set(problem, next, Some(loser));
                self.best[loser] = next;
                placed += 1;
            }
            good = placed == losers.len() && gain > EQUAL;
            if good {
                self.best[at] = branch;
                self.best_score += gain;
            } else {
                // As it was: first nobody has anything, then those who had it.
                losers[..placed].iter().for_each(|loser| self.set(problem, self.best[*loser], None));
                self.set(problem, branch, None);
                for (k, &loser) in losers.iter().enumerate() {
                    self.best[loser] = self.current[k];
                    self.set(problem, self.current[k], Some(loser));
                }
                self.set(problem, before, Some(at));
            }
        }
        self.losers = losers;
        good
    }

    fn set(&mut self, problem: &GlobalHypothesis, branch: usize, owner: Option<usize>) {
        problem.of(branch).iter().for_each(|detection| self.owner[*detection] = owner);
    }
}
