//! The whole of it: sequences × trackers, what is missing is run, everything is scored.

use crate::film::Film;
use crate::protocol::Pass;
use crate::run::{parameters_of, run_pass};
use crate::store::Store;
use crate::summary::{Outcome, tracker_results};
use crate::{Dataset, EvaluationError, Protocol, Result, Results, RunRecord, Sequence, Trajectory};
use pursuit_media::OpenOptions;
use pursuit_tracking::Recipe;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// A tracker that takes part: a recipe under the name it has in the results.
pub struct Contestant {
    /// Its name in folders, tables and plots.
    pub name: String,
    /// What makes it.
    pub recipe: Box<dyn Recipe>,
}

impl From<Box<dyn Recipe>> for Contestant {
    fn from(recipe: Box<dyn Recipe>) -> Self {
        Self { name: recipe.name().to_owned(), recipe }
    }
}

/// What to evaluate, and how.
pub struct EvalOptions {
    /// Folders to search for sequences, or single sequences.
    pub datasets: Vec<PathBuf>,
    /// Who takes part.
    pub trackers: Vec<Contestant>,
    /// What is run.
    pub protocol: Protocol,
    /// Comma-separated patterns of the sequences wanted; all without.
    pub sequences: Option<String>,
    /// Sequences worked on at once, each by one thread. Results do not depend on it; on a busy machine speeds may.
    pub jobs: usize,
    /// Where results are kept: `boxes/`, `results.json`, `report.html`. Protocols may share a folder.
    pub out: PathBuf,
    /// What made the run (a version, a build's hash): results that another build left are run again.
    pub build: String,
    /// Memory that decoded frames may take, in bytes; longer sequences are decoded again for every tracker.
    pub frame_memory_bytes: u64,
    /// Whether `report.html` is written.
    pub report: bool,
    /// Whether the report shows frames of the sequences (which are decoded once more for it).
    pub thumbnails: bool,
    /// How frames are opened.
    pub open: OpenOptions,
}

impl EvalOptions {
    /// The defaults: everything below `datasets`, one pass, one job, 1.5 GB of frames, a report with pictures.
    pub fn new(datasets: Vec<PathBuf>, trackers: Vec<Contestant>, out: PathBuf) -> Self {
        Self {
            datasets,
            trackers,
            protocol: Protocol::Ope,
            sequences: None,
            jobs: 1,
            out,
            build: env!("CARGO_PKG_VERSION").to_owned(),
            frame_memory_bytes: 1_500_000_000,
            report: true,
            thumbnails: true,
            open: OpenOptions::default(),
        }
    }
}

/// News of an evaluation in progress.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Progress {
    /// The sequences have been found.
    Found {
        /// How many there are.
        sequences: usize,
        /// How many pairs of tracker and sequence there are.
        runs: usize,
        /// What looked like a sequence and cannot be used.
        problems: Vec<String>,
    },
    /// A tracker is done with a sequence.
    Finished {
        /// The tracker.
        tracker: String,
        /// The sequence.
        sequence: String,
        /// Whether an earlier call had run it.
        reused: bool,
        /// Success AUC.
        auc: f64,
        /// Updates a second.
        fps: Option<f64>,
        /// What stopped it early.
        error: Option<String>,
        /// Pairs done, this one included.
        done: usize,
        /// Pairs there are.
        runs: usize,
    },
    /// The frames of a sequence cannot be had.
    LeftOut {
        /// Which sequence, and why.
        problem: String,
        /// Pairs done, those of this sequence included.
        done: usize,
    },
    /// The report is being written.
    Reporting,
}

/// What one tracker left on one sequence.
pub(crate) type Passes = Vec<(Trajectory, RunRecord)>;

/// Runs what is missing, scores everything, and writes `results.json` and `report.html`.
///
/// Setting `stop` ends it after the current frame: what is complete is kept and scored, and the same call goes on later.
///
/// # Errors
/// Nothing to evaluate, no footage that can be opened, results that cannot be written. A tracker's error and a sequence
/// that cannot be opened are part of the results.
pub fn evaluate(options: &EvalOptions, progress: &(dyn Fn(Progress) + Sync), stop: &AtomicBool) -> Result<Results> {
    let dataset = find(options)?;
    let mut problems: Vec<String> = dataset.problems.iter().map(ToString::to_string).collect();
    let runs = dataset.sequences.len() * options.trackers.len();
    progress(Progress::Found { sequences: dataset.sequences.len(), runs, problems: problems.clone() });
    let session =
        Session { options, store: Store::new(&options.out)?, progress, stop, runs, done: AtomicUsize::new(0) };
    let finished = session.run_all(&dataset.sequences, &mut problems)?;

    let mut results = Results { protocol: options.protocol, problems, ..Results::default() };
    results.interrupted = stop.load(Ordering::Relaxed);
    let mut kept: BTreeMap<String, BTreeMap<String, Passes>> = BTreeMap::new();
    for contestant in &options.trackers {
        let mut outcomes = BTreeMap::new();
        for (sequence, by_tracker) in dataset.sequences.iter().zip(&finished) {
            let Some(passes) = by_tracker.get(&contestant.name) else { continue };
            outcomes.insert(sequence.name().to_owned(), Outcome::new(options.protocol, sequence, passes));
            kept.entry(contestant.name.clone()).or_default().insert(sequence.name().to_owned(), passes.clone());
        }
        let parameters = parameters_of(&*contestant.recipe)?;
        results.trackers.insert(contestant.name.clone(), tracker_results(parameters, outcomes));
    }
    session.store.write_results(&results)?;
    if options.report {
        progress(Progress::Reporting);
        let page = crate::report::page(options, &dataset.sequences, &results, &kept, stop);
        session.store.write_report(options.protocol, &page)?;
    }
    Ok(results)
}

fn find(options: &EvalOptions) -> Result<Dataset> {
    if options.trackers.is_empty() {
        return Err(EvaluationError::Option("no tracker to evaluate; name one or several".to_owned()));
    }
    let mut dataset = Dataset::discover_all(&options.datasets, &options.open)?;
    if dataset.sequences.is_empty() && !dataset.problems.is_empty() {
        return Err(dataset.problems.remove(0));
    }
    if dataset.sequences.is_empty() {
        let name = options.datasets.iter().map(|d| d.display().to_string()).collect::<Vec<_>>().join(", ");
        let reason = "was found; sequences are folders with frames.csv, videos NAME.mp4 with NAME.csv, or folders as \
                      OTB, VOT, GOT-10k, UAV123, TLD, Princeton RGB-D and MOTChallenge publish them";
        return Err(EvaluationError::NoSequences { name, reason: reason.to_owned() });
    }
    if let Some(patterns) = &options.sequences {
        dataset.retain_matching(patterns)?;
    }
    Ok(dataset)
}

/// What all threads of an evaluation share.
struct Session<'a> {
    options: &'a EvalOptions,
    store: Store,
    progress: &'a (dyn Fn(Progress) + Sync),
    stop: &'a AtomicBool,
    runs: usize,
    done: AtomicUsize,
}

type ByTracker = BTreeMap<String, Passes>;

impl Session<'_> {
    /// Works through the sequences on `jobs` threads; what comes out does not depend on who did what when.
    /// Sequences that cannot be opened are added to `problems`; only when there is no other is that an error.
    fn run_all(&self, sequences: &[Sequence], problems: &mut Vec<String>) -> Result<Vec<ByTracker>> {
        let next = AtomicUsize::new(0);
        let slots: Vec<Mutex<Option<Result<ByTracker>>>> = sequences.iter().map(|_| Mutex::default()).collect();
        let failed = AtomicBool::new(false);
        let work = || {
            while !self.stop.load(Ordering::Relaxed) && !failed.load(Ordering::Relaxed) {
                let i = next.fetch_add(1, Ordering::Relaxed);
                let (Some(sequence), Some(slot)) = (sequences.get(i), slots.get(i)) else { break };
                let outcome = self.run_sequence(sequence);
                match &outcome {
                    Err(e @ EvaluationError::Frames { .. }) => self.leave_out(e),
                    other => drop(failed.fetch_or(other.is_err(), Ordering::Relaxed)),
                }
                *slot.lock().unwrap_or_else(PoisonError::into_inner) = Some(outcome);
            }
        };
        std::thread::scope(|scope| {
            for _ in 0..self.options.jobs.clamp(1, sequences.len().max(1)) {
                scope.spawn(|| one_threaded(work));
            }
        });
        let mut all = Vec::with_capacity(slots.len());
        let mut first_left_out = None;
        for slot in slots {
            all.push(match slot.into_inner().unwrap_or_else(PoisonError::into_inner) {
                Some(Err(e @ EvaluationError::Frames { .. })) => {
                    problems.push(e.to_string());
                    first_left_out.get_or_insert(e);
                    ByTracker::new()
                }
                Some(outcome) => outcome?,
                None => ByTracker::new(),
            });
        }
        match first_left_out {
            Some(e) if all.iter().all(ByTracker::is_empty) => Err(e),
            _ => Ok(all),
        }
    }

    fn leave_out(&self, problem: &EvaluationError) {
        let trackers = self.options.trackers.len();
        let done = self.done.fetch_add(trackers, Ordering::Relaxed) + trackers;
        (self.progress)(Progress::LeftOut { problem: problem.to_string(), done });
    }

    /// All trackers on one sequence: what earlier calls left is read back, the rest is run.
    fn run_sequence(&self, sequence: &Sequence) -> Result<ByTracker> {
        let passes = self.options.protocol.passes(sequence);
        let mut film = None;
        let mut finished = ByTracker::new();
        for contestant in &self.options.trackers {
            let parameters = parameters_of(&*contestant.recipe)?;
            let mut reused = true;
            let mut done = Passes::new();
            for pass in &passes {
                let kept = self.store.read(&contestant.name, sequence, pass, |record| {
                    record.parameters == parameters
                        && record.build == self.options.build
                        && record.protocol.runs_like(self.options.protocol)
                });
                let run = match kept {
                    Some(run) => run,
                    None => {
                        reused = false;
                        let film = match &mut film {
                            Some(film) => film,
                            empty => empty.insert(self.load(sequence)?),
                        };
                        match self.run_and_keep(contestant, sequence, film, pass)? {
                            Some(run) => run,
                            None => return Ok(finished),
                        }
                    }
                };
                done.push(run);
            }
            self.announce(contestant, sequence, &done, reused);
            finished.insert(contestant.name.clone(), done);
        }
        Ok(finished)
    }

    fn load<'f>(&'f self, sequence: &'f Sequence) -> Result<Film<'f>> {
        let budget = self.options.frame_memory_bytes / self.options.jobs.max(1) as u64;
        Film::load(sequence, &self.options.open, budget, self.stop)
    }

    fn run_and_keep(
        &self,
        contestant: &Contestant,
        sequence: &Sequence,
        film: &Film<'_>,
        pass: &Pass,
    ) -> Result<Option<(Trajectory, RunRecord)>> {
        let (recipe, build) = (&*contestant.recipe, &self.options.build);
        let run = run_pass(recipe, sequence, film, pass, self.options.protocol, build, self.stop)?;
        let Some((trajectory, record)) = run else { return Ok(None) };
        // What is scored is what the files say, so that scoring again gives the same figures to the last digit.
        self.store.write(&contestant.name, sequence, pass, &trajectory, &record).map(Some)
    }

    fn announce(&self, contestant: &Contestant, sequence: &Sequence, passes: &Passes, reused: bool) {
        let score = Outcome::new(self.options.protocol, sequence, passes).score;
        (self.progress)(Progress::Finished {
            tracker: contestant.name.clone(),
            sequence: sequence.name().to_owned(),
            reused,
            auc: score.auc,
            fps: score.fps,
            error: score.error,
            done: self.done.fetch_add(1, Ordering::Relaxed) + 1,
            runs: self.runs,
        });
    }
}

/// Runs `work` where a tracker that would spread over cores finds one thread only: this one.
fn one_threaded(work: impl FnOnce() + Send) {
    match rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build() {
        Ok(_pool) => work(),
        // Already a pool's thread: a tracker then shares that pool.
        Err(_) => work(),
    }
}
