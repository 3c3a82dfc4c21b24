//! `pursuit eval` and `pursuit reproduce` as functions.

use crate::errors::{ComputationError, UsageError, of_run, usage};
use crate::registry::to_python;
use crate::values;
use pursuit::config::recipes;
use pursuit::evaluation::{Entry, EvalOptions, Progress, evaluate as run};
use pursuit::media::OpenOptions;
use pursuit::{RunError, toml};
use pursuit_experiments::{ExperimentError, Options, Paper};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// How often a wait looks for Ctrl-C.
const BREATH: Duration = Duration::from_millis(50);

pub fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(evaluate, module)?)?;
    module.add_function(wrap_pyfunction!(reproduce, module)?)
}

/// Measures trackers on annotated sequences, as `pursuit eval` does; returns what results.json holds.
#[pyfunction]
#[pyo3(signature = (datasets, trackers, out, *, protocol, sequences, jobs, report, against, build, parameters))]
#[allow(clippy::too_many_arguments, reason = "named on the Python side")]
fn evaluate<'py>(
    py: Python<'py>,
    datasets: Vec<PathBuf>,
    trackers: Vec<String>,
    out: PathBuf,
    protocol: &str,
    sequences: Option<String>,
    jobs: usize,
    report: bool,
    against: Option<PathBuf>,
    build: String,
    parameters: &Bound<'py, PyDict>,
) -> PyResult<Bound<'py, PyAny>> {
    let parameters: toml::Table = values::table(parameters)?;
    let recipes = recipes(&trackers, &parameters).map_err(|e| of_run(&e))?;
    let mut options = EvalOptions::new(datasets, recipes.into_iter().map(Entry::from).collect(), out);
    options.protocol = protocol.parse().map_err(|e| of_run(&RunError::from(e)))?;
    if jobs == 0 {
        return Err(usage("jobs is 0; give 1 or more"));
    }
    (options.sequences, options.jobs, options.report) = (sequences, jobs, report);
    (options.against, options.build, options.open) = (against, build, OpenOptions::from_env());
    let stop = AtomicBool::new(false);
    let results = py.detach(|| {
        std::thread::scope(|scope| {
            let running = scope.spawn(|| run(&options, &|_: Progress| {}, &stop));
            while !running.is_finished() {
                std::thread::sleep(BREATH);
                // Ctrl-C ends it after the frame in hand; what is complete is kept.
                if Python::attach(|py| py.check_signals()).is_err() {
                    stop.store(true, Ordering::Relaxed);
                }
            }
            running.join()
        })
    });
    let results =
        results.map_err(|_| ComputationError::new_err("the evaluation broke off; this is a defect of pursuit"))?;
    let results = results.map_err(|e| of_run(&e.into()))?;
    to_python(py, &results)
}

/// Runs a paper's experiment again, as `pursuit reproduce` does; returns its figures beside ours.
#[pyfunction]
#[pyo3(signature = (paper, *, out = None, seeds = None, dataset = None))]
fn reproduce<'py>(
    py: Python<'py>,
    paper: &str,
    out: Option<PathBuf>,
    seeds: Option<u32>,
    dataset: Option<PathBuf>,
) -> PyResult<Bound<'py, PyAny>> {
    let paper: Paper = paper.parse().map_err(|e: ExperimentError| of_experiment(&e))?;
    let run = || {
        let reproduction = pursuit_experiments::run(paper, &Options { seeds, dataset })?;
        if let Some(out) = &out {
            reproduction.write(out)?;
        }
        Ok(reproduction)
    };
    let reproduction = py.detach(run).map_err(|e| of_experiment(&e))?;
    to_python(py, &reproduction)
}

fn of_experiment(error: &ExperimentError) -> PyErr {
    match error.exit_code() {
        2 => UsageError::new_err(error.to_string()),
        _ => ComputationError::new_err(error.to_string()),
    }
}
