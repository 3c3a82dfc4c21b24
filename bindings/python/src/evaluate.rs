//! `pursuit eval` and `pursuit reproduce` as functions.

use crate::errors::{ComputationError, UsageError, of_run, usage};
use crate::foreign::PythonRecipe;
use crate::registry::to_python;
use crate::values;
use pursuit::BBox;
use pursuit::config::recipes;
use pursuit::evaluation::metrics::many::{Crowd, Labelled, clear, hota, identity};
use pursuit::evaluation::{Entry, EvalOptions, EvaluationError, Given, Progress, evaluate as run};
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

/// Measures trackers on annotated sequences, as `pursuit eval` does; returns what results.json holds. `trackers` are names in
/// the results with a name of the registry or what makes a tracker of Python; `given` names with paths of trajectories.
#[pyfunction]
#[pyo3(signature = (datasets, trackers, given, out, *, protocol, sequences, attributes, jobs, report, against, build, started, channels, parameters))]
#[allow(clippy::too_many_arguments, reason = "named on the Python side")]
fn evaluate<'py>(
    py: Python<'py>,
    datasets: Vec<PathBuf>,
    trackers: Vec<(String, Bound<'py, PyAny>)>,
    given: Vec<(String, PathBuf)>,
    out: PathBuf,
    protocol: &str,
    sequences: Option<String>,
    attributes: Option<PathBuf>,
    jobs: usize,
    report: bool,
    against: Option<PathBuf>,
    build: String,
    started: String,
    channels: &str,
    parameters: &Bound<'py, PyDict>,
) -> PyResult<Bound<'py, PyAny>> {
    let bgr = match channels {
        "rgb" => false,
        "bgr" => true,
        _ => return Err(usage(format!("channels is \"{channels}\"; it is \"rgb\" or \"bgr\""))),
    };
    let trackers = entries(trackers, &values::table(parameters)?, bgr, &started)?;
    let mut options = EvalOptions::new(datasets, trackers, out);
    options.given = given.into_iter().map(|(name, path)| Given { name, path }).collect();
    options.protocol = protocol.parse().map_err(|e| of_run(&RunError::from(e)))?;
    if jobs == 0 {
        return Err(usage("jobs is 0; give 1 or more"));
    }
    (options.sequences, options.jobs, options.report) = (sequences, jobs, report);
    (options.attributes, options.against, options.build) = (attributes, against, build);
    options.open = OpenOptions::from_env();
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

/// The trackers that take part, in the order given: those of the registry with their parameters, and those of Python.
fn entries(
    trackers: Vec<(String, Bound<'_, PyAny>)>,
    parameters: &toml::Table,
    bgr: bool,
    started: &str,
) -> PyResult<Vec<Entry>> {
    let registered: Vec<String> = trackers.iter().filter_map(|(_, tracker)| tracker.extract().ok()).collect();
    let mut made = recipes(&registered, parameters).map_err(|e| of_run(&e))?.into_iter();
    let entry = |(name, tracker): (String, Bound<'_, PyAny>)| {
        if tracker.extract::<String>().is_ok() {
            return Ok(made.next().map(|recipe| Entry { name, recipe }));
        }
        if !tracker.is_callable() {
            let problem = "is neither the name of a tracker nor a class or function that makes one";
            return Err(usage(format!("{name}: {} {problem}", tracker.repr()?)));
        }
        let recipe = PythonRecipe::new(name.clone(), tracker.unbind(), bgr, started.to_owned());
        Ok(Some(Entry { name, recipe: Box::new(recipe) }))
    };
    trackers.into_iter().map(entry).filter_map(PyResult::transpose).collect()
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
