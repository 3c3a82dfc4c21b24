//! Trackers written in Python, as recipes: what `pursuit.eval` runs beside those of the registry.

use crate::errors::usage;
use crate::values;
use numpy::{PyArray1, PyArrayMethods};
use pursuit::imaging::Rgb8;
use pursuit::parameters::{Parameter, ParameterError};
use pursuit::toml::{Table, Value};
use pursuit::tracking::{
    Appearance, Estimate, Forecast, Measurement, Needs, Recipe, Result, TrackState, Tracker, TrackingError,
};
use pursuit::{BBox, Frame};
use pyo3::prelude::*;
use pyo3::types::PyBool;

/// A class, or any callable, that makes objects with `init(frame, box)` and `update(frame)`.
pub struct PythonRecipe {
    name: String,
    factory: Py<PyAny>,
    /// Whether colour frames are handed over in the order blue, green, red.
    bgr: bool,
    /// Tells this run from any other: what Python code does may change without a trace, so its boxes are never those of
    /// an earlier run.
    started: String,
}

impl PythonRecipe {
    /// From what makes the trackers, under a name.
    pub fn new(name: String, factory: Py<PyAny>, bgr: bool, started: String) -> Self {
        Self { name, factory, bgr, started }
    }

    fn copy(&self) -> Self {
        let factory = Python::attach(|py| self.factory.clone_ref(py));
        Self { name: self.name.clone(), factory, bgr: self.bgr, started: self.started.clone() }
    }

    /// A failure of the Python code, in its own words.
    fn failed(&self, frame: &Frame, error: PyErr) -> TrackingError {
        TrackingError::Computation { tracker: self.name.clone(), index: frame.index(), source: Box::new(error) }
    }

    /// An object that has been started on the target.
    fn started(&self, frame: &Frame, bbox: BBox) -> Result<Py<PyAny>> {
        pursuit::tracking::check_box(frame, bbox)?;
        let start = |py: Python<'_>| -> PyResult<Py<PyAny>> {
            let tracker = self.factory.call0(py)?;
            tracker.call_method1(py, "init", (pixels(py, frame, self.bgr)?, values::ltwh(bbox)))?;
            Ok(tracker)
        };
        Python::attach(start).map_err(|e| self.failed(frame, e))
    }

    /// Trackers of Python live in the process that made them.
    fn unsaved(&self) -> TrackingError {
        let problem = "trackers written in Python are neither saved nor shared out".to_owned();
        TrackingError::Snapshot { tracker: self.name.clone(), problem }
    }
}

impl Recipe for PythonRecipe {
    fn name(&self) -> &str {
        &self.name
    }

    fn needs(&self) -> Needs {
        Needs::default()
    }

    fn schema(&self) -> Vec<Parameter> {
        Vec::new()
    }

    fn parameters(&self) -> Result<Table> {
        let factory = Python::attach(|py| self.factory.bind(py).repr().map(|r| r.to_string())).unwrap_or_default();
        Ok(Table::from_iter([
            ("python".to_owned(), Value::String(factory)),
            ("started".to_owned(), Value::String(self.started.clone())),
        ]))
    }

    fn with(&self, changes: &Table) -> Result<Box<dyn Recipe>> {
        match changes.keys().next() {
            Some(key) => {
                Err(ParameterError::new(&self.name, key, "a tracker written in Python has no parameters").into())
            }
            None => Ok(self.boxed_clone()),
        }
    }

    fn init(&self, frame: &Frame, bbox: BBox) -> Result<Box<dyn Tracker>> {
        Ok(Box::new(PythonTracker { recipe: self.copy(), object: self.started(frame, bbox)?, bbox }))
    }

    fn appearance(&self, _: &Frame, _: BBox) -> Result<Box<dyn Appearance>> {
        Err(self.unsaved())
    }

    fn restore_appearance(&self, _: &[u8]) -> Result<Box<dyn Appearance>> {
        Err(self.unsaved())
    }

    fn restore(&self, _: &[u8]) -> Result<Box<dyn Tracker>> {
        Err(self.unsaved())
    }

    fn boxed_clone(&self) -> Box<dyn Recipe> {
        Box::new(self.copy())
    }
}

/// A tracker of Python that has been started.
struct PythonTracker {
    recipe: PythonRecipe,
    object: Py<PyAny>,
    /// The box said last.
    bbox: BBox,
}

impl Tracker for PythonTracker {
    fn update(&mut self, frame: &Frame) -> Result<Estimate> {
        let update = |py: Python<'_>| {
            let said = self.object.call_method1(py, "update", (pixels(py, frame, self.recipe.bgr)?,))?;
            answer(said.bind(py), self.bbox)
        };
        let (bbox, state, score) = Python::attach(update).map_err(|e| self.recipe.failed(frame, e))?;
        self.bbox = bbox;
        Ok(Estimate { state, measurement: None, ..Estimate::started(frame.time_s(), bbox, score) })
    }

    fn peek(&mut self, _: &Frame) -> Result<Option<Measurement>> {
        Ok(None)
    }

    fn forecast(&self, _: f64) -> Result<Forecast> {
        Ok(Forecast { time_s: 0.0, bbox: self.bbox, covariance: None, velocity: None })
    }

    fn reinit(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        (self.object, self.bbox) = (self.recipe.started(frame, bbox)?, bbox);
        Ok(())
    }

    fn change(&mut self, changes: &Table) -> Result<()> {
        self.recipe.with(changes).map(drop)
    }

    fn save(&self) -> Result<Vec<u8>> {
        Err(self.recipe.unsaved())
    }

    fn boxed_clone(&self) -> Box<dyn Tracker> {
        let object = Python::attach(|py| self.object.clone_ref(py));
        Box::new(Self { recipe: self.recipe.copy(), object, bbox: self.bbox })
    }
}

/// A frame as an array of its own: (height, width) of grey ones, (height, width, 3) of colour.
fn pixels<'py>(py: Python<'py>, frame: &Frame, bgr: bool) -> PyResult<Bound<'py, PyAny>> {
    let size = frame.size();
    let (width, height) = (size.width, size.height);
    if !frame.has_color() {
        let gray = frame.gray();
        let values: Vec<u8> = gray.rows().flatten().copied().collect();
        return Ok(PyArray1::from_vec(py, values).reshape([height, width])?.into_any());
    }
    let color = frame.color();
    let ordered = |&[r, g, b]: &Rgb8| if bgr { [b, g, r] } else { [r, g, b] };
    let values: Vec<u8> = color.rows().flatten().flat_map(ordered).collect();
    Ok(PyArray1::from_vec(py, values).reshape([height, width, 3])?.into_any())
}

/// What an `update` returned: a box; `(ok, box)` as OpenCV's trackers; `(box, score)`; an object with `box` and, if it has
/// them, `state` and `score`; `None` where the target is not seen, whose box is then the one `before`. A box without a score is
/// one that its tracker is sure of.
fn answer(said: &Bound<'_, PyAny>, before: BBox) -> PyResult<(BBox, TrackState, f64)> {
    let lost = (before, TrackState::Lost, 0.0);
    if said.is_none() {
        return Ok(lost);
    }
    if let Ok(bbox) = said.getattr("box") {
        let state = match said.getattr("state") {
            Ok(state) => {
                let word = state.extract::<String>()?;
                TrackState::from_word(&word)
                    .ok_or_else(|| usage(format!("state `{word}` is none of tracking, unsure, occluded, lost")))?
            }
            Err(_) => TrackState::Tracking,
        };
        let score = said.getattr("score").map_or(Ok(1.0), |s| score(&s))?;
        return Ok((values::bbox(&bbox)?, state, score));
    }
    let items: Vec<Bound<'_, PyAny>> = said.try_iter()?.collect::<PyResult<_>>()?;
    match items.as_slice() {
        [ok, bbox] if ok.is_instance_of::<PyBool>() || ok.get_type().name()? == "bool" => match ok.is_truthy()? {
            true => Ok((values::bbox(bbox)?, TrackState::Tracking, 1.0)),
            false => Ok(lost),
        },
        [bbox, given] => Ok((values::bbox(bbox)?, TrackState::Tracking, score(given)?)),
        _ => Ok((values::bbox(said)?, TrackState::Tracking, 1.0)),
    }
}

fn score(object: &Bound<'_, PyAny>) -> PyResult<f64> {
    let score: f64 = object.extract()?;
    if (0.0..=1.0).contains(&score) {
        Ok(score)
    } else {
        Err(usage(format!("score is {score}; it is the probability, from 0 to 1, that the box is right")))
    }
}
