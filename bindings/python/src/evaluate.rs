//! `pursuit eval` and `pursuit reproduce` as functions.

use crate::errors::{ComputationError, UsageError, of_run, usage};
use crate::registry::to_python;
use crate::values;
use pursuit::BBox;
use pursuit::config::recipes;
use pursuit::evaluation::metrics::many::{Crowd, Labelled, clear, hota, identity};
use pursuit::evaluation::{Entry, EvalOptions, EvaluationError, Progress, evaluate as run};
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
    module.add_function(wrap_pyfunction!(crowd_scores, module)?)?;
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

/// A box of many: frame, target, left, top, width, height in pixels.
type Row = (u64, u64, f64, f64, f64, f64);

/// HOTA, CLEAR MOT and IDF1 with what they are made of, as TrackEval names it, of what is true and what is said.
#[pyfunction]
fn crowd_scores<'py>(py: Python<'py>, truth: Vec<Row>, said: Vec<Row>, threshold: f64) -> PyResult<Bound<'py, PyDict>> {
    if !(threshold > 0.0 && threshold <= 1.0) {
        return Err(usage(format!("threshold is {threshold}; an overlap is above 0 and at most 1, for example 0.5")));
    }
    let labelled = |rows: Vec<Row>| -> Vec<Labelled> {
        let one = |(frame, target, l, t, w, h)| Labelled { frame, target, bbox: BBox::from_ltwh(l, t, w, h) };
        rows.into_iter().map(one).collect()
    };
    let judged = py.detach(|| {
        let crowd = Crowd::new(&labelled(truth), &labelled(said))?;
        Ok((clear(&crowd, threshold)?, identity(&crowd, threshold)?, hota(&crowd)?))
    });
    let (clear, identity, hota) = judged.map_err(|e: EvaluationError| of_run(&e.into()))?;
    let figures = PyDict::new(py);
    for (name, value) in [
        ("HOTA", hota.hota),
        ("DetA", hota.detection),
        ("AssA", hota.association),
        ("LocA", hota.localization),
        ("MOTA", clear.mota()),
        ("MOTP", clear.motp()),
        ("IDF1", identity.idf1()),
        ("IDR", identity.recall()),
        ("IDP", identity.precision()),
    ] {
        figures.set_item(name, value)?;
    }
    for (name, count) in [
        ("CLR_TP", clear.matches),
        ("CLR_FN", clear.misses),
        ("CLR_FP", clear.false_alarms),
        ("IDSW", clear.switches),
        ("IDTP", identity.matches),
        ("IDFN", identity.misses),
        ("IDFP", identity.false_alarms),
    ] {
        figures.set_item(name, count)?;
    }
    Ok(figures)
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
