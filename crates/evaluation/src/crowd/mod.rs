//! Many targets: results of trackers in MOTChallenge's or KITTI's form held against the truth, as TrackEval does it.

mod figures;
mod report;
mod rules;
mod sets;
mod truth;

pub use figures::{CrowdComparison, CrowdFigures, CrowdTracker};
pub use rules::CrowdRules;
pub use sets::CrowdSequence;

use crate::boxes::{BoxRow, Boxes, read_boxes};
use crate::metrics::many::{Labelled, Match};
use crate::store::write_whole;
use crate::table::aligned;
use crate::{EvaluationError, Given, Result};
use figures::Parts;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use truth::CrowdTruth;

/// What is to be scored, and how.
#[derive(Debug, Clone)]
pub struct CrowdOptions {
    /// Folders with sets, sets, or sequences.
    pub datasets: Vec<PathBuf>,
    /// Comma-separated patterns of the sequences wanted; all without.
    pub sequences: Option<String>,
    /// Results by name: folders with `SEQUENCE.txt`, `SET/SEQUENCE.txt` (each may lie in a folder `data`) or
    /// `SEQUENCE/trajectory.txt`; a file where there is one sequence.
    pub given: Vec<Given>,
    /// What is counted.
    pub rules: CrowdRules,
    /// Where `results.json` and `report.html` go.
    pub out: PathBuf,
    /// Whether the report is written.
    pub report: bool,
}

/// All figures; what `results.json` holds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CrowdResults {
    /// `mot`.
    pub protocol: String,
    /// What is counted.
    pub rules: CrowdRules,
    /// Figures by tracker.
    pub trackers: BTreeMap<String, CrowdTracker>,
    /// Every tracker against those ranked below it.
    pub comparisons: Vec<CrowdComparison>,
}

impl CrowdResults {
    /// Trackers, the best mean HOTA first.
    pub fn ranked(&self) -> Vec<(&String, &CrowdTracker)> {
        let mut ranked: Vec<_> = self.trackers.iter().collect();
        ranked.sort_by(|a, b| b.1.mean.HOTA.total_cmp(&a.1.mean.HOTA).then_with(|| a.0.cmp(b.0)));
        ranked
    }

    /// The table for a terminal: a line for every tracker and set, shares in per cent.
    pub fn text_table(&self) -> String {
        let names = [
            "tracker", "set", "HOTA", "DetA", "AssA", "LocA", "MOTA", "MOTP", "IDF1", "IDSW", "Frag", "FP", "FN", "MT",
            "ML",
        ];
        let mut rows = vec![names.map(str::to_owned).to_vec()];
        let row = |name: &str, set: &str, f: &CrowdFigures| {
            let shares = [f.HOTA, f.DetA, f.AssA, f.LocA, f.MOTA, f.MOTP, f.IDF1].map(|v| format!("{:.2}", 100.0 * v));
            let counts = [f.IDSW, f.Frag, f.FP, f.FN, f.MT, f.ML].map(|n| n.to_string());
            [name.to_owned(), set.to_owned()].into_iter().chain(shares).chain(counts).collect::<Vec<_>>()
        };
        for (name, tracker) in self.ranked() {
            rows.extend(tracker.sets.iter().map(|(set, f)| row(name, set, f)));
            for (class, sets) in &tracker.classes {
                rows.extend(sets.iter().map(|(set, f)| row(name, &format!("{set} {class}"), f)));
            }
            if tracker.sets.len() > 1 {
                rows.push(row(name, "mean", &tracker.mean));
            }
        }
        aligned(&rows) + &self.compared()
    }

    fn compared(&self) -> String {
        if self.comparisons.is_empty() {
            return String::new();
        }
        let mut rows = vec![
            ["tracker", "against", "figure", "sequences", "difference", "95 % interval", "is"]
                .map(str::to_owned)
                .to_vec(),
        ];
        for c in &self.comparisons {
            let [low, high] = c.interval.map(|v| format!("{:+.2}", 100.0 * v));
            let difference = format!("{:+.2}", 100.0 * c.difference);
            let cells = [c.tracker.clone(), c.against.clone(), c.figure.clone(), c.sequences.to_string(), difference];
            rows.push(cells.into_iter().chain([format!("{low} … {high}"), c.judgement.to_string()]).collect());
        }
        format!("\n{}", aligned(&rows))
    }
}

/// One tracker on one sequence.
struct Judged {
    set: String,
    title: String,
    /// By class; one without a name where the truth has none.
    parts: BTreeMap<&'static str, Parts>,
    /// Which true target was found by whom.
    matches: Vec<Match>,
    truth: Vec<Labelled>,
}

/// Scores the results, and writes `results.json` and `report.html`.
///
/// # Errors
/// Nothing to score, truth or results that cannot be read or make no sense, and files that cannot be written.
pub fn evaluate_crowds(options: &CrowdOptions) -> Result<CrowdResults> {
    let sequences = CrowdSequence::discover_all(&options.datasets, options.sequences.as_deref())?;
    check(options)?;
    let read = |s: &CrowdSequence| match &s.truth {
        Some(path) => CrowdTruth::read(path, &s.name),
        None => {
            Err(EvaluationError::NoSequences { name: s.title(), reason: "can be scored: it has no gt.txt".to_owned() })
        }
    };
    let truths: Vec<CrowdTruth> = sequences.par_iter().map(read).collect::<Result<_>>()?;
    let mut all = BTreeMap::new();
    for given in &options.given {
        let judge =
            |(s, truth): (&CrowdSequence, &CrowdTruth)| judge(given, s, truth, &sequences, &truths, options.rules);
        let judged: Vec<Judged> = sequences.par_iter().zip(&truths).map(judge).collect::<Result<_>>()?;
        all.insert(given.name.clone(), judged);
    }
    let trackers: BTreeMap<_, _> = all.iter().map(|(name, judged)| (name.clone(), summed(judged))).collect();
    let mut results =
        CrowdResults { protocol: "mot".to_owned(), rules: options.rules, trackers, comparisons: Vec::new() };
    results.comparisons = figures::comparisons(&results.ranked());
    let json = serde_json::to_vec_pretty(&results).map_err(|e| EvaluationError::encoding("results.json", e))?;
    let files = [("json", json), ("html", report::page(&results, &sequences, &all).into_bytes())];
    for (extension, bytes) in files.iter().filter(|(e, _)| *e == "json" || options.report) {
        let name = if *extension == "json" { "results" } else { "report" };
        write_whole(&options.out.join(format!("{name}-mot.{extension}")), bytes)?;
        write_whole(&options.out.join(format!("{name}.{extension}")), bytes)?;
    }
    Ok(results)
}

fn check(options: &CrowdOptions) -> Result<()> {
    if options.given.is_empty() {
        return Err(EvaluationError::Option("nothing to score; name results with --results NAME=FOLDER".to_owned()));
    }
    for (i, given) in options.given.iter().enumerate() {
        if options.given.iter().skip(i + 1).any(|other| other.name == given.name) {
            return Err(EvaluationError::Option(format!("{} is the name of two results; give another", given.name)));
        }
    }
    Ok(())
}

/// One tracker's results of one sequence.
fn judge(
    given: &Given,
    sequence: &CrowdSequence,
    truth: &CrowdTruth,
    sequences: &[CrowdSequence],
    truths: &[CrowdTruth],
    rules: CrowdRules,
) -> Result<Judged> {
    let path = results_of(&given.path, sequence, sequences)?;
    let said = read_boxes(&path, None, None)?;
    let (truth, said) = match said.origin() == truth.origin {
        true => (truth.clone(), said),
        false => (in_pixels(truth), said.in_pixels()),
    };
    sound(&path, &said, sequence.frames.unwrap_or_else(|| truth.frames().max(said.frames())), &truth)?;
    let in_set = |(s, t): (&CrowdSequence, &CrowdTruth)| s.set == sequence.set && !t.regions.is_empty();
    let least_height = rules.least_height(sequences.iter().zip(truths).any(in_set));
    let classes: Vec<Option<&'static str>> = match &truth.classes[..] {
        [] => vec![None],
        classes => classes.iter().copied().map(Some).collect(),
    };
    let mut judged = Judged {
        set: sequence.set.clone(),
        title: sequence.title(),
        parts: BTreeMap::new(),
        matches: Vec::new(),
        truth: Vec::new(),
    };
    for class in classes {
        let (to_find, counted) = rules::counted(&truth, said.rows(), class, least_height)?;
        let parts = Parts::of(&to_find, &counted, |m| judged.matches.push(m))
            .map_err(|e| EvaluationError::dataset(&path, None, format!("of {}: {e}", sequence.title())))?;
        judged.parts.insert(class.unwrap_or_default(), parts);
        judged.truth.extend(to_find);
    }
    Ok(judged)
}

/// Results have to have ids and stay inside the sequence; where the truth has several classes they have to have theirs.
fn sound(path: &Path, said: &Boxes, frames: u64, truth: &CrowdTruth) -> Result<()> {
    let wrong = |reason: String| Err(EvaluationError::dataset(path, None, reason));
    let without = |row: &BoxRow| row.id.is_none();
    if let Some(row) = said.rows().iter().find(|r| without(r)) {
        return wrong(format!("frame {} has a box without an id; these are detections, not results", row.frame));
    }
    if said.frames() > frames {
        return wrong(format!("speaks of frame {} counted from 0; the sequence has {frames}", said.frames() - 1));
    }
    if truth.classes.len() > 1 && said.rows().iter().any(|r| r.class.is_none()) {
        let classes = truth.classes.join(", ");
        return wrong(format!("says no classes where the truth has {classes}; give results in KITTI's form"));
    }
    Ok(())
}

fn in_pixels(truth: &CrowdTruth) -> CrowdTruth {
    let mut truth = truth.clone();
    let by = -truth.origin;
    truth.boxes.iter_mut().for_each(|b| b.bbox = b.bbox.translated(by, by));
    truth.regions.iter_mut().for_each(|(_, b)| *b = b.translated(by, by));
    truth.origin = 0.0;
    truth
}

/// Where the results of a sequence are.
fn results_of(root: &Path, sequence: &CrowdSequence, sequences: &[CrowdSequence]) -> Result<PathBuf> {
    let CrowdSequence { set, name, .. } = sequence;
    let file = format!("{name}.txt");
    let mut places = vec![root.join(set).join(&file), root.join(set).join("data").join(&file)];
    if sequences.iter().all(|s| s.set == *set) {
        places.extend([root.join(&file), root.join("data").join(&file), root.join(name).join("trajectory.txt")]);
    }
    if sequences.len() == 1 && root.is_file() {
        places.push(root.to_owned());
    }
    let found = places.iter().find(|p| p.is_file()).cloned();
    let looked = || places.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(", ");
    found.ok_or_else(|| {
        EvaluationError::dataset(root, None, format!("has no results of {}; looked for {}", sequence.title(), looked()))
    })
}

/// Sequences of a set are combined, sets are averaged.
fn summed(judged: &[Judged]) -> CrowdTracker {
    let mut tracker = CrowdTracker::default();
    let mut sets: BTreeMap<&str, Vec<&Judged>> = BTreeMap::new();
    for one in judged {
        sets.entry(&one.set).or_default().push(one);
        tracker.sequences.insert(one.title.clone(), Parts::combined(one.parts.values()).figures());
    }
    for (set, members) in sets {
        let whole = Parts::combined(members.iter().flat_map(|one| one.parts.values()));
        tracker.sets.insert(set.to_owned(), whole.figures());
        let classes = members.iter().flat_map(|one| one.parts.keys()).filter(|class| !class.is_empty());
        for class in classes {
            let of_class = Parts::combined(members.iter().filter_map(|one| one.parts.get(class)));
            tracker.classes.entry((*class).to_owned()).or_default().insert(set.to_owned(), of_class.figures());
        }
    }
    tracker.averaged()
}
