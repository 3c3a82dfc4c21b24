//! Clips of a batch one by one, for engines that share them out among processes and machines: `pursuit.ray`.

use crate::errors::{PursuitError, of_run, usage};
use crate::values;
use pursuit::batch::{BatchSummary, ClipEnd, ClipJob, ClipOutcome, is_finished, parse_manifest, run_clip};
use pursuit::media::OpenOptions;
use pursuit::{Fetched, RunConfig, toml};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// How often a wait looks for signals.
const BREATH: Duration = Duration::from_millis(10);

const DONE: &str = "done";
const EARLIER: &str = "earlier";
const FAILED: &str = "failed";
const STOPPED: &str = "stopped";

pub fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(batch_jobs, module)?)?;
    module.add_function(wrap_pyfunction!(batch_clip, module)?)?;
    module.add_function(wrap_pyfunction!(batch_finished, module)?)?;
    module.add_function(wrap_pyfunction!(batch_failed, module)?)?;
    module.add_function(wrap_pyfunction!(batch_summary, module)?)
}

/// A clip as it goes from process to process: name, address of the input with its credentials, of the depth, the configuration
/// as TOML.
type Job = (String, String, Option<String>, String);

/// The clips of the text of a manifest, which messages call `name`; `common` says what they do not say.
#[pyfunction]
fn batch_jobs(text: &str, name: &str, common: &Bound<'_, PyDict>) -> PyResult<Vec<Job>> {
    let common = RunConfig::deserialize(values::table(common)?)
        .map_err(|e| usage(e.to_string().lines().next().unwrap_or_default().to_owned()))?;
    let common = RunConfig { video: Some(common.video == Some(true)), ..common };
    let packed = |ClipJob { name, config }: ClipJob| {
        let input = config.input.as_ref().map(|input| input.reveal().to_owned()).unwrap_or_default();
        let text = toml::to_string(&config).map_err(|e| usage(e.to_string()))?;
        Ok((name, input, config.depth, text))
    };
    parse_manifest(text, name, &common).map_err(|e| of_run(&e))?.into_iter().map(packed).collect()
}

fn unpacked((name, input, _, config): Job) -> PyResult<ClipJob> {
    let config: RunConfig = toml::from_str(&config).map_err(|e| usage(e.to_string()))?;
    Ok(ClipJob { name, config: RunConfig { input: Some(input.into()), ..config } })
}

/// Tracks a clip into the folder of a batch, unless that is done; `fetched` says where on this machine the addresses lie that
/// something else has read. Returns how it ended and, but where it was stopped, what finished.json holds.
#[pyfunction]
fn batch_clip(
    py: Python<'_>,
    job: Job,
    out: PathBuf,
    fetched: BTreeMap<String, PathBuf>,
) -> PyResult<(&'static str, Option<String>)> {
    let (job, fetched) = (unpacked(job)?, Fetched::new(fetched));
    let stop = AtomicBool::new(false);
    let (end, interrupted) = py.detach(|| {
        std::thread::scope(|scope| {
            let running = scope.spawn(|| run_clip(&job, &fetched, &out, &OpenOptions::from_env(), &stop));
            let mut interrupted = None;
            while !running.is_finished() {
                std::thread::sleep(BREATH);
                // Ctrl-C and what else a signal's handler raises end it after the frame in hand.
                if let Err(signal) = Python::attach(|py| py.check_signals()) {
                    stop.store(true, Ordering::Relaxed);
                    interrupted.get_or_insert(signal);
                }
            }
            (running.join(), interrupted)
        })
    });
    if let Some(signal) = interrupted {
        return Err(signal);
    }
    let end = end.map_err(|_| PursuitError::new_err("tracking broke off; this is a defect of pursuit"))?;
    let (how, outcome) = match end.map_err(|e| of_run(&e))? {
        ClipEnd::Done { outcome, earlier } => (if earlier { EARLIER } else { DONE }, Some(outcome)),
        ClipEnd::Failed(outcome) => (FAILED, Some(outcome)),
        ClipEnd::Stopped => (STOPPED, None),
    };
    let text = outcome.map(|outcome| serde_json::to_string(&outcome)).transpose().map_err(|e| usage(e.to_string()))?;
    Ok((how, text))
}

/// Whether an earlier call did this clip of the batch in the folder `out`.
#[pyfunction]
fn batch_finished(job: Job, out: PathBuf) -> PyResult<bool> {
    is_finished(&unpacked(job)?, &out).map_err(|e| of_run(&e))
}

/// What finished.json would hold of a clip that could not be come to, by this error.
#[pyfunction]
fn batch_failed(job: Job, error: String) -> PyResult<String> {
    let job = unpacked(job)?;
    let error = job.config.input.as_ref().map_or_else(|| error.clone(), |input| input.redact(&error));
    serde_json::to_string(&ClipOutcome::failed(&job, error)).map_err(|e| usage(e.to_string()))
}

/// What batch.json holds: of the ends of the clips that were come to, in order, out of `clips`.
#[pyfunction]
fn batch_summary(ends: Vec<(String, Option<String>)>, clips: usize, seconds: f64) -> PyResult<String> {
    let read = |(how, outcome): (String, Option<String>)| {
        let Some(outcome) = outcome.filter(|_| how != STOPPED) else { return Ok(ClipEnd::Stopped) };
        let outcome: ClipOutcome = serde_json::from_str(&outcome).map_err(|e| usage(e.to_string()))?;
        Ok(if how == FAILED { ClipEnd::Failed(outcome) } else { ClipEnd::Done { outcome, earlier: how == EARLIER } })
    };
    let ends = ends.into_iter().map(read).collect::<PyResult<Vec<_>>>()?;
    let summary = BatchSummary::new(ends, clips, seconds);
    serde_json::to_string_pretty(&summary).map(|text| text + "\n").map_err(|e| usage(e.to_string()))
}
