//! Sequences × trackers: what is missing is run, everything is scored.

use crate::comparison::{compare, read_others};
use crate::frame_cache::FrameCache;
use crate::protocol::Pass;
use crate::run::{Passes, parameters_of, run_pass};
use crate::store::Store;
use crate::summary::{SequenceOutcome, tracker_results};
use crate::{Dataset, Entry, EvalOptions, EvaluationError, Protocol, Result, Results, RunRecord, Sequence, Trajectory};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

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

/// Runs what is missing, scores everything, and writes `results.json`, `tables/`, `curves/` and `report.html`.
///
/// Setting `stop` ends it after the current frame: what is complete is kept and scored, and the same call goes on later.
///
/// # Errors
/// Nothing to evaluate, no footage that can be opened, results that cannot be written. A tracker's error and a sequence
/// that cannot be opened are part of the results.
pub fn evaluate(options: &EvalOptions, progress: &(dyn Fn(Progress) + Sync), stop: &AtomicBool) -> Result<Results> {
    let others = options.against.as_deref().map(read_others).transpose()?.unwrap_or_default();
    let dataset = find(options)?;
    let mut problems: Vec<String> = dataset.problems.iter().map(ToString::to_string).collect();
    let runs = dataset.sequences.len() * (options.trackers.len() + options.given.len());
    progress(Progress::Found { sequences: dataset.sequences.len(), runs, problems: problems.clone() });
    let evaluation =
        Evaluation { options, store: Store::new(&options.out)?, progress, stop, runs, done: AtomicUsize::new(0) };
    let finished = evaluation.run_all(&dataset.sequences, &mut problems)?;

    let mut results = Results { protocol: options.protocol, problems, ..Results::default() };
    results.interrupted = stop.load(Ordering::Relaxed);
    let mut kept: BTreeMap<String, BTreeMap<String, Passes>> = BTreeMap::new();
    let attributes = dataset.sequences.iter().map(|s| (s.name(), s.attributes())).collect();
    let run = options.trackers.iter().map(|entry| Ok((&entry.name, parameters_of(&*entry.recipe)?)));
    for scored in run.chain(options.given.iter().map(|given| Ok((&given.name, given.parameters())))) {
        let (tracker, parameters) = scored?;
        let mut outcomes = BTreeMap::new();
        for (sequence, by_tracker) in dataset.sequences.iter().zip(&finished) {
            let Some(passes) = by_tracker.get(tracker) else { continue };
            outcomes.insert(sequence.name().to_owned(), SequenceOutcome::new(options.protocol, sequence, passes));
            kept.entry(tracker.clone()).or_default().insert(sequence.name().to_owned(), passes.clone());
        }
        results.trackers.insert(tracker.clone(), tracker_results(parameters, outcomes, &attributes));
    }
    compare(&mut results, &others);
    evaluation.store.write_results(&results)?;
    if options.report {
        progress(Progress::Reporting);
        let page = crate::report::page(options, &dataset.sequences, &results, &kept, stop);
        evaluation.store.write_report(options.protocol, &page)?;
    }
    Ok(results)
}

fn find(options: &EvalOptions) -> Result<Dataset> {
    if options.trackers.is_empty() && options.given.is_empty() {
        return Err(EvaluationError::Option("no tracker to evaluate; name one or several".to_owned()));
    }
    if !options.given.is_empty() && matches!(options.protocol, Protocol::Sre | Protocol::Tre) {
        let problem = format!(
            "trajectories made before are of one pass, or of VOT's supervised experiment (`reset`); {} runs several",
            options.protocol
        );
        return Err(EvaluationError::Option(problem));
    }
    let mut names: Vec<&String> = options.trackers.iter().map(|entry| &entry.name).collect();
    for given in &options.given {
        if names.contains(&&given.name) {
            return Err(EvaluationError::Option(format!("{} is the name of two results; give another", given.name)));
        }
        names.push(&given.name);
    }
    let mut dataset = Dataset::discover_all(&options.datasets, &options.open)?;
    if let Some(file) = &options.attributes {
        dataset.add_attributes(file)?;
    }
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
struct Evaluation<'a> {
    options: &'a EvalOptions,
    store: Store,
    progress: &'a (dyn Fn(Progress) + Sync),
    stop: &'a AtomicBool,
    runs: usize,
    done: AtomicUsize,
}

type ByTracker = BTreeMap<String, Passes>;

impl Evaluation<'_> {
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
                let passes = self.run_sequence(sequence, sequences.len() == 1);
                match &passes {
                    Err(e @ EvaluationError::Frames { .. }) => self.leave_out(e),
                    other => drop(failed.fetch_or(other.is_err(), Ordering::Relaxed)),
                }
                *slot.lock().unwrap_or_else(PoisonError::into_inner) = Some(passes);
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
                Some(passes) => passes?,
                None => ByTracker::new(),
            });
        }
        match first_left_out {
            Some(e) if all.iter().all(ByTracker::is_empty) => Err(e),
            _ => Ok(all),
        }
    }

    fn leave_out(&self, problem: &EvaluationError) {
        let trackers = self.options.trackers.len() + self.options.given.len();
        let done = self.done.fetch_add(trackers, Ordering::Relaxed) + trackers;
        (self.progress)(Progress::LeftOut { problem: problem.to_string(), done });
    }

    /// All trackers on one sequence, which may be the only one: what earlier calls left is read back, the rest is run.
    fn run_sequence(&self, sequence: &Sequence, alone: bool) -> Result<ByTracker> {
        let passes = self.options.protocol.passes(sequence);
        let footage_bytes = sequence.footage().bytes();
        let mut frames = None;
        let mut finished = ByTracker::new();
        for entry in &self.options.trackers {
            let parameters = parameters_of(&*entry.recipe)?;
            let mut reused = true;
            let mut done = Passes::new();
            for pass in &passes {
                let kept = self.store.read(&entry.name, sequence, pass, |record| {
                    record.parameters == parameters
                        && record.footage_bytes == footage_bytes
                        && record.starts_at(&pass.bbox)
                        && record.build == self.options.build
                        && record.protocol.runs_like(self.options.protocol)
                        // What went wrong may have been mended since: a file or a library that was missing.
                        && record.error.is_none()
                });
                let run = match kept {
                    Some(run) => run,
                    None => {
                        reused = false;
                        let frames = match &mut frames {
                            Some(frames) => frames,
                            empty => empty.insert(self.load(sequence)?),
                        };
                        match self.run_and_keep(entry, sequence, frames, pass)? {
                            Some(run) => run,
                            None => return Ok(finished),
                        }
                    }
                };
                done.push(run);
            }
            self.announce(&entry.name, sequence, &done, reused);
            finished.insert(entry.name.clone(), done);
        }
        for given in &self.options.given {
            let done = given.passes(sequence, alone, self.options.protocol, &self.options.build)?;
            self.announce(&given.name, sequence, &done, true);
            finished.insert(given.name.clone(), done);
        }
        Ok(finished)
    }

    fn load<'f>(&'f self, sequence: &'f Sequence) -> Result<FrameCache<'f>> {
        let budget = self.options.frame_memory_bytes / self.options.jobs.max(1) as u64;
        FrameCache::load(sequence, &self.options.open, budget, self.stop)
    }

    fn run_and_keep(
        &self,
        entry: &Entry,
        sequence: &Sequence,
        frames: &FrameCache<'_>,
        pass: &Pass,
    ) -> Result<Option<(Trajectory, RunRecord)>> {
        let (recipe, build) = (&*entry.recipe, &self.options.build);
        let run = run_pass(recipe, sequence, frames, pass, self.options.protocol, build, self.stop)?;
        let Some((trajectory, record)) = run else { return Ok(None) };
        // What is scored is what the files say, so that scoring again gives the same figures to the last digit.
        self.store.write(&entry.name, sequence, pass, &trajectory, &record).map(Some)
    }

    fn announce(&self, tracker: &str, sequence: &Sequence, passes: &Passes, reused: bool) {
        let score = SequenceOutcome::new(self.options.protocol, sequence, passes).score;
        (self.progress)(Progress::Finished {
            tracker: tracker.to_owned(),
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
