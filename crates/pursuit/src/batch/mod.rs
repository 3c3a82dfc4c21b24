//! Many clips on one machine: each as `pursuit track` does it, several at a time, what is finished never again.
//!
//! ```no_run
//! use pursuit::batch::{BatchOptions, clips_of, run};
//! use std::sync::atomic::AtomicBool;
//!
//! let common = toml::from_str("tracker = 'kcf'\nvideo = false").unwrap_or_default();
//! let clips = clips_of(["a.mp4".into(), "b.mp4".into()], &common)?;
//! let summary = run(&clips, &BatchOptions::new("results"), &|_| {}, &AtomicBool::new(false))?;
//! assert_eq!(summary.clips.len() + summary.failed.len(), 2);
//! # Ok::<(), pursuit::RunError>(())
//! ```
//!
//! The folder holds `clips/NAME/` with the files of each run, `dataset/clip=NAME/trajectory.parquet` (in builds with the
//! feature `parquet`; the columns of `trajectory.csv` under the partition `clip`), and `batch.json`. A clip counts as done when
//! its `finished.json` is there, which is written after everything else of it.

mod ledger;
mod manifest;

pub use ledger::ClipOutcome;
pub use manifest::{ClipJob, clips_of, parse_manifest, read_manifest};

use crate::{Fetched, Run, RunConfig, RunError};
use ledger::Ledger;
use pursuit_media::OpenOptions;
use serde::Serialize;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// How a batch is run.
#[derive(Debug, Clone)]
pub struct BatchOptions {
    /// Where results go; what an earlier call finished there is kept.
    pub out: PathBuf,
    /// Clips at a time, ≥ 1.
    pub jobs: usize,
    /// How inputs are opened.
    pub open: OpenOptions,
}

impl BatchOptions {
    /// As many clips at a time as there are processors.
    pub fn new(out: impl Into<PathBuf>) -> Self {
        let jobs = std::thread::available_parallelism().map_or(1, usize::from);
        Self { out: out.into(), jobs, open: OpenOptions::default() }
    }
}

/// News of a batch.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum BatchNews {
    /// A clip is done, or an earlier call had done it.
    Done {
        /// The clip.
        clip: String,
        /// Frames looked at.
        frames: u64,
        /// Whether an earlier call had done it.
        earlier: bool,
    },
    /// Something is wrong with a clip; the others go on.
    Failed {
        /// The clip.
        clip: String,
        /// What is wrong.
        error: String,
    },
}

/// How a batch ended.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct BatchSummary {
    /// Clips that are done, in order of the batch.
    pub clips: Vec<ClipOutcome>,
    /// Clips with which something is wrong; the next call runs them again.
    pub failed: Vec<ClipOutcome>,
    /// How many of those done an earlier call had done.
    pub earlier: usize,
    /// Clips that were not come to, or not to the end, because the batch was stopped.
    pub left: usize,
    /// Whether there is a dataset: this build can write Parquet.
    pub dataset: bool,
    /// Seconds that this call took.
    pub seconds: f64,
}

impl BatchSummary {
    /// Of the ends of the clips that were come to, in order, out of `clips`.
    pub fn new(ends: impl IntoIterator<Item = ClipEnd>, clips: usize, seconds: f64) -> Self {
        let mut summary = Self { dataset: cfg!(feature = "parquet"), seconds, ..Self::default() };
        for end in ends {
            match end {
                ClipEnd::Done { outcome, earlier } => {
                    summary.earlier += usize::from(earlier);
                    summary.clips.push(outcome);
                }
                ClipEnd::Failed(outcome) => summary.failed.push(outcome),
                ClipEnd::Stopped => {}
            }
        }
        summary.left = clips.saturating_sub(summary.clips.len() + summary.failed.len());
        summary
    }

    /// Writes `batch.json` into the folder of the batch.
    ///
    /// # Errors
    /// [`RunError::Output`].
    pub fn write(&self, out: &Path) -> Result<(), RunError> {
        Ledger::new(out)?.summarise(self)
    }
}

/// How one clip ended.
#[derive(Debug, Clone, PartialEq)]
pub enum ClipEnd {
    /// It is done.
    Done {
        /// What was done.
        outcome: ClipOutcome,
        /// Whether an earlier call had done it.
        earlier: bool,
    },
    /// Something is wrong with it.
    Failed(ClipOutcome),
    /// It was stopped.
    Stopped,
}

/// Tracks every clip that is not done yet. Setting `stop` ends it after the frames in hand; the same call goes on later.
///
/// # Errors
/// No clips, no jobs, a folder that cannot be written. What is wrong with a clip is in the summary.
pub fn run(
    clips: &[ClipJob],
    options: &BatchOptions,
    tell: &(dyn Fn(BatchNews) + Sync),
    stop: &AtomicBool,
) -> Result<BatchSummary, RunError> {
    if clips.is_empty() {
        return Err(RunError::usage("there are no clips; name videos, folders of images, or a manifest"));
    }
    if options.jobs == 0 {
        return Err(RunError::usage("0 jobs do nothing; give 1 or more"));
    }
    if options.out == Path::new("-") {
        return Err(RunError::usage("a batch does not go to standard output; name a folder with `--out DIR`"));
    }
    if clips.iter().any(|clip| clip.config.segment.is_some()) {
        return Err(RunError::usage("a clip of a batch is one trajectory; leave `segment` out"));
    }
    let (began, ledger) = (Instant::now(), Ledger::new(&options.out)?);
    let (next, ended) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    std::thread::scope(|scope| {
        for _ in 0..options.jobs.min(clips.len()) {
            scope.spawn(|| {
                while let Some((index, job)) = take(&next, clips, stop) {
                    let end = one(job, &Fetched::default(), &ledger, &options.open, stop);
                    announce(&end, tell);
                    ended.lock().unwrap_or_else(PoisonError::into_inner).push((index, end));
                }
            });
        }
    });
    let mut ended = ended.into_inner().unwrap_or_else(PoisonError::into_inner);
    ended.sort_by_key(|(index, _)| *index);
    let summary = BatchSummary::new(ended.into_iter().map(|(_, end)| end), clips.len(), began.elapsed().as_secs_f64());
    ledger.summarise(&summary)?;
    Ok(summary)
}

/// The next clip, unless the batch was stopped.
fn take<'a>(next: &AtomicUsize, clips: &'a [ClipJob], stop: &AtomicBool) -> Option<(usize, &'a ClipJob)> {
    if stop.load(Ordering::Relaxed) {
        return None;
    }
    let index = next.fetch_add(1, Ordering::Relaxed);
    clips.get(index).map(|job| (index, job))
}

/// Tracks one clip of a batch into its folder, unless that is done; for engines that share a batch out among machines.
/// [`parse_manifest`] has the clips, [`BatchSummary::write`] concludes.
///
/// # Errors
/// A folder that cannot be written. What is wrong with the clip is in its end.
pub fn run_clip(
    job: &ClipJob,
    fetched: &Fetched,
    out: &Path,
    open: &OpenOptions,
    stop: &AtomicBool,
) -> Result<ClipEnd, RunError> {
    Ok(one(job, fetched, &Ledger::new(out)?, open, stop))
}

/// Whether an earlier call did this clip of the batch in `out`.
///
/// # Errors
/// A folder that cannot be written.
pub fn is_finished(job: &ClipJob, out: &Path) -> Result<bool, RunError> {
    Ok(Ledger::new(out)?.finished(job).is_some())
}

fn announce(end: &ClipEnd, tell: &(dyn Fn(BatchNews) + Sync)) {
    match end {
        ClipEnd::Done { outcome, earlier } => {
            tell(BatchNews::Done { clip: outcome.clip.clone(), frames: outcome.frames, earlier: *earlier });
        }
        ClipEnd::Failed(outcome) => {
            let error = outcome.error.clone().unwrap_or_default();
            tell(BatchNews::Failed { clip: outcome.clip.clone(), error });
        }
        ClipEnd::Stopped => {}
    }
}

/// One clip, whatever becomes of it.
fn one(job: &ClipJob, fetched: &Fetched, ledger: &Ledger, open: &OpenOptions, stop: &AtomicBool) -> ClipEnd {
    if let Some(outcome) = ledger.finished(job) {
        return ClipEnd::Done { outcome, earlier: true };
    }
    let began = Instant::now();
    let mut outcome = ClipOutcome::new(job);
    // A defect that one clip brings to light must not cost the others.
    let tracked = catch_unwind(AssertUnwindSafe(|| track(job, fetched, ledger, open, stop)));
    outcome.seconds = began.elapsed().as_secs_f64();
    match tracked {
        Ok(Ok(None)) => return ClipEnd::Stopped,
        Ok(Ok(Some((frames, failure)))) => (outcome.frames, outcome.error) = (frames, failure.map(|e| e.to_string())),
        Ok(Err(error)) => outcome.error = Some(error.to_string()),
        Err(_) => outcome.error = Some("tracking it ended in a panic, which is a defect of pursuit".to_owned()),
    }
    outcome.error = outcome.error.map(|error| fetched.renamed(error));
    if let Err(error) = ledger.finish(&outcome) {
        outcome.error.get_or_insert(error.to_string());
    }
    if outcome.error.is_some() { ClipEnd::Failed(outcome) } else { ClipEnd::Done { outcome, earlier: false } }
}

/// Frames, and what ended it early; nothing where it was stopped.
fn track(
    job: &ClipJob,
    fetched: &Fetched,
    ledger: &Ledger,
    open: &OpenOptions,
    stop: &AtomicBool,
) -> Result<Option<(u64, Option<RunError>)>, RunError> {
    let config = RunConfig { out: Some(ledger.clip(&job.name)), ..job.config.clone() };
    let run = Run::prepare_fetched(config, fetched.clone(), open)?;
    ledger.begin(&job.name)?;
    #[cfg(feature = "parquet")]
    let (partition, part) = ledger.partition(&job.name)?;
    #[cfg(feature = "parquet")]
    let run = run.with_sink(Box::new(crate::sinks::ParquetSink::create(&part)?));
    let remote = run.remote();
    let finished = run.run(|_| {
        if stop.load(Ordering::Relaxed) {
            remote.stop();
        }
    })?;
    if finished.outcome.interrupted {
        return Ok(None);
    }
    #[cfg(feature = "parquet")]
    std::fs::File::open(&part)
        .and_then(|file| file.sync_all())
        .and_then(|()| std::fs::rename(&part, &partition))
        .map_err(RunError::output(&partition))?;
    Ok(Some((finished.facts.frame_count, finished.outcome.failure)))
}
