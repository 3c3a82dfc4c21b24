//! A survey: many trackers by kinds, ranked with what the differences allow, in tables, charts and one page.

mod page;
mod pictures;

use crate::columns::Better;
use crate::results::MeanScore;
use crate::store::write_whole;
use crate::table::{Cell, Table, lines_of_csv};
use crate::{Comparison, Judgement, Result, Results};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A kind of trackers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Family {
    /// Its word.
    pub name: String,
    /// One sentence on what its trackers have in common.
    pub sentence: String,
    /// The names of its trackers; those that took no part may be among them.
    pub members: Vec<String>,
}

/// Trackers that no family names.
const OTHERS: &str = "others";

/// What a survey says.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Survey {
    /// A line for each tracker, the best success AUC first.
    pub trackers: Vec<SurveyLine>,
    /// A line for each family that has a tracker in it, the best tracker's family first.
    pub families: Vec<FamilyLine>,
    /// The best tracker of each family against that of each family ranked below it.
    pub between: Vec<Comparison>,
}

/// A tracker of a survey.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SurveyLine {
    /// Its name.
    pub tracker: String,
    /// Its family's word.
    pub family: String,
    /// Success AUC, its interval, ranks, precision, success rate, speed and what else there is.
    #[serde(flatten)]
    pub score: MeanScore,
}

/// A family of a survey.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FamilyLine {
    /// Its word.
    pub family: String,
    /// What its trackers have in common.
    pub sentence: String,
    /// Its trackers, the best first.
    pub members: Vec<String>,
    /// The best and the worst rank among the families' best trackers that the comparisons allow.
    pub rank: Option<[usize; 2]>,
    /// Success AUC of the best tracker.
    pub auc: f64,
    /// Its 95 % interval.
    pub auc_interval: Option<[f64; 2]>,
    /// Speed of the best tracker, updates a second on one thread.
    pub fps: Option<f64>,
    /// Mean success AUC over the trackers.
    pub mean_auc: f64,
    /// The fastest tracker and its speed.
    pub fastest: Option<(String, f64)>,
}

impl Survey {
    /// The survey of an evaluation; a tracker that no family names is one of the `others`.
    pub fn new(results: &Results, families: &[Family]) -> Self {
        let family_of = |tracker: &str| families.iter().find(|f| f.members.iter().any(|m| m == tracker));
        let line = |name: &str| {
            let score = results.trackers.get(name)?.mean.clone();
            let family = family_of(name).map_or(OTHERS, |f| f.name.as_str()).to_owned();
            Some(SurveyLine { tracker: name.to_owned(), family, score })
        };
        let trackers: Vec<SurveyLine> = results.ranking().into_iter().filter_map(line).collect();
        let mut lines: Vec<FamilyLine> = Vec::new();
        for tracker in &trackers {
            match lines.iter_mut().find(|l| l.family == tracker.family) {
                Some(line) => line.add(tracker),
                None => {
                    let sentence = family_of(&tracker.tracker).map_or_else(String::new, |f| f.sentence.clone());
                    lines.push(FamilyLine::of(tracker, sentence));
                }
            }
        }
        let between = between(results, &mut lines);
        Self { trackers, families: lines, between }
    }

    /// The number of a family, which chooses its colour.
    fn number(&self, family: &str) -> usize {
        self.families.iter().position(|l| l.family == family).unwrap_or(self.families.len())
    }

    /// The trackers for readers: rank, name, family, figures.
    fn tracker_table(&self) -> Table {
        let heads = [
            ("tracker", Better::Neither),
            ("family", Better::Neither),
            ("rank", Better::Neither),
            ("AUC", Better::Higher),
            ("95 %", Better::Neither),
            ("P20", Better::Higher),
            ("SR50", Better::Higher),
            ("fps", Better::Higher),
            ("ECE", Better::Lower),
            ("sequences", Better::Neither),
        ];
        let row = |l: &SurveyLine| {
            let s = &l.score;
            vec![
                Cell::text(&l.tracker),
                Cell::text(&l.family),
                Cell::text(span(s.rank)),
                Cell::figure(Some(s.auc), 3),
                Cell::text(interval(s.auc_interval)),
                Cell::figure(Some(s.precision20), 3),
                Cell::figure(Some(s.success50), 3),
                Cell::figure(s.fps, 0),
                Cell::figure(s.calibration_error, 3),
                Cell::text(s.sequences.to_string()),
            ]
        };
        Table::new(&heads, self.trackers.iter().map(row).collect())
    }

    /// The families for readers.
    fn family_table(&self) -> Table {
        let heads = [
            ("family", Better::Neither),
            ("trackers", Better::Neither),
            ("best", Better::Neither),
            ("rank", Better::Neither),
            ("AUC", Better::Higher),
            ("95 %", Better::Neither),
            ("fps", Better::Higher),
            ("mean AUC", Better::Higher),
            ("fastest", Better::Neither),
        ];
        let row = |l: &FamilyLine| {
            let fastest = l.fastest.as_ref().map_or_else(|| "-".to_owned(), |(name, fps)| format!("{name} {fps:.0}"));
            vec![
                Cell::text(&l.family),
                Cell::text(l.members.len().to_string()),
                Cell::text(l.members.first().map_or("-", String::as_str)),
                Cell::text(span(l.rank)),
                Cell::figure(Some(l.auc), 3),
                Cell::text(interval(l.auc_interval)),
                Cell::figure(l.fps, 0),
                Cell::figure(Some(l.mean_auc), 3),
                Cell::text(fastest),
            ]
        };
        Table::new(&heads, self.families.iter().map(row).collect())
    }

    /// Both tables as text for a terminal.
    pub fn to_text(&self) -> String {
        format!("{}\n{}", self.tracker_table().to_text(), self.family_table().to_text())
    }

    /// Both tables as GitHub's Markdown, the best figure of each column in bold.
    pub fn to_markdown(&self) -> String {
        let sentences: String = self
            .families
            .iter()
            .filter(|l| !l.sentence.is_empty())
            .map(|l| format!("- {}: {}\n", l.family, l.sentence))
            .collect();
        format!("{}\n{}\n{sentences}", self.tracker_table().to_markdown(), self.family_table().to_markdown())
    }

    /// The trackers as CSV, with all digits.
    pub fn to_csv(&self) -> String {
        let heads = [
            "tracker",
            "family",
            "rank_low",
            "rank_high",
            "auc",
            "auc_low",
            "auc_high",
            "precision20",
            "success50",
            "fps",
            "calibration_error",
            "sequences",
        ];
        let line = |l: &SurveyLine| {
            let s = &l.score;
            let figures = [Some(s.precision20), Some(s.success50), s.fps, s.calibration_error].map(cell);
            let [rank_low, rank_high] = ends(s.rank.map(|r| r.map(|v| v as f64)));
            let [low, high] = ends(s.auc_interval);
            let mut line = vec![l.tracker.clone(), l.family.clone(), rank_low, rank_high, s.auc.to_string(), low, high];
            line.extend(figures);
            line.push(s.sequences.to_string());
            line
        };
        lines_of_csv(std::iter::once(heads.map(str::to_owned).to_vec()).chain(self.trackers.iter().map(line)))
    }

    /// The families as CSV, with all digits.
    pub fn families_to_csv(&self) -> String {
        let heads = [
            "family",
            "trackers",
            "best",
            "rank_low",
            "rank_high",
            "auc",
            "auc_low",
            "auc_high",
            "fps",
            "mean_auc",
            "fastest",
            "fastest_fps",
        ];
        let line = |l: &FamilyLine| {
            let [rank_low, rank_high] = ends(l.rank.map(|r| r.map(|v| v as f64)));
            let [low, high] = ends(l.auc_interval);
            let (fastest, fps) = l.fastest.clone().map_or_else(Default::default, |(n, f)| (n, f.to_string()));
            let best = l.members.first().cloned().unwrap_or_default();
            let (count, auc) = (l.members.len().to_string(), l.auc.to_string());
            let mean = l.mean_auc.to_string();
            vec![l.family.clone(), count, best, rank_low, rank_high, auc, low, high, cell(l.fps), mean, fastest, fps]
        };
        lines_of_csv(std::iter::once(heads.map(str::to_owned).to_vec()).chain(self.families.iter().map(line)))
    }

    /// Writes `survey.html`, `survey.md`, `survey.csv`, `families.csv`, `speed-and-accuracy.svg` and, of sequences with at least
    /// three attributes, `attributes.svg` into `folder`; returns what was written.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn write(&self, results: &Results, folder: &Path) -> Result<Vec<PathBuf>> {
        let mut files = vec![
            ("survey.html", page::page(self, results)),
            ("survey.md", self.to_markdown()),
            ("survey.csv", self.to_csv()),
            ("families.csv", self.families_to_csv()),
        ];
        files.extend(pictures::speed(self).to_svg().map(|svg| ("speed-and-accuracy.svg", svg)));
        files.extend(pictures::attributes(self, results).and_then(|r| r.to_svg()).map(|svg| ("attributes.svg", svg)));
        // What an earlier survey drew of other sequences would be taken for this one's.
        for name in ["speed-and-accuracy.svg", "attributes.svg"] {
            if !files.iter().any(|(file, _)| *file == name) {
                let _ = std::fs::remove_file(folder.join(name));
            }
        }
        let mut written = Vec::new();
        for (name, text) in files {
            let path = folder.join(name);
            write_whole(&path, text.as_bytes())?;
            written.push(path);
        }
        Ok(written)
    }
}

impl FamilyLine {
    /// Of its best tracker.
    fn of(best: &SurveyLine, sentence: String) -> Self {
        let score = &best.score;
        Self {
            family: best.family.clone(),
            sentence,
            members: vec![best.tracker.clone()],
            rank: None,
            auc: score.auc,
            auc_interval: score.auc_interval,
            fps: score.fps,
            mean_auc: score.auc,
            fastest: score.fps.map(|fps| (best.tracker.clone(), fps)),
        }
    }

    fn add(&mut self, tracker: &SurveyLine) {
        self.members.push(tracker.tracker.clone());
        self.mean_auc += (tracker.score.auc - self.mean_auc) / self.members.len() as f64;
        if let Some(fps) = tracker.score.fps.filter(|fps| self.fastest.as_ref().is_none_or(|(_, f)| fps > f)) {
            self.fastest = Some((tracker.tracker.clone(), fps));
        }
    }
}

/// The families' best trackers against each other, which gives each family the ranks that this leaves it.
fn between(results: &Results, lines: &mut [FamilyLine]) -> Vec<Comparison> {
    let aucs = |name: &str| -> BTreeMap<String, f64> {
        let of = results.trackers.get(name).map(|t| &t.sequences);
        of.into_iter().flatten().map(|(sequence, score)| (sequence.clone(), score.auc)).collect()
    };
    let bests: Vec<(String, BTreeMap<String, f64>)> =
        lines.iter().filter_map(|l| l.members.first()).map(|name| (name.clone(), aucs(name))).collect();
    let mut clear = vec![(0, 0); bests.len()];
    let mut all = Vec::new();
    for (i, (name, own)) in bests.iter().enumerate() {
        for (j, (below, others)) in bests.iter().enumerate().skip(i + 1) {
            let Some(comparison) = Comparison::new((name, own), (below, others)) else { continue };
            match comparison.judgement {
                Judgement::Better => (clear[j].0 += 1, clear[i].1 += 1),
                Judgement::Worse => (clear[i].0 += 1, clear[j].1 += 1),
                Judgement::CannotTell => ((), ()),
            };
            all.push(comparison);
        }
    }
    let count = lines.len();
    for (line, (ahead, behind)) in lines.iter_mut().zip(clear).filter(|_| count > 1) {
        line.rank = Some([1 + ahead, count - behind]);
    }
    all
}

/// `3–5`, `4`, or `-`.
fn span(rank: Option<[usize; 2]>) -> String {
    match rank {
        Some([low, high]) if low == high => low.to_string(),
        Some([low, high]) => format!("{low}–{high}"),
        None => "-".to_owned(),
    }
}

fn interval(ends: Option<[f64; 2]>) -> String {
    ends.map_or_else(|| "-".to_owned(), |[low, high]| format!("{low:.3}–{high:.3}"))
}

fn cell(value: Option<f64>) -> String {
    value.map_or_else(String::new, |v| v.to_string())
}

fn ends(span: Option<[f64; 2]>) -> [String; 2] {
    span.map_or_else(Default::default, |ends| ends.map(|v| v.to_string()))
}

#[cfg(test)]
mod tests;
