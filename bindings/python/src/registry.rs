//! The lists of trackers and detectors with their parameters, for the Python side to make names and help of.

use crate::errors::{of_tracking, usage};
use pursuit::trackers::registry;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::Serialize;

pub fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(trackers, module)?)?;
    module.add_function(wrap_pyfunction!(detectors, module)?)?;
    module.add_function(wrap_pyfunction!(parameters, module)?)?;
    module.add("DEFAULT_TRACKER", registry::DEFAULT_TRACKER)
}

/// A value as Python's dicts, lists, texts and numbers.
pub fn to_python<'py>(py: Python<'py>, value: &impl Serialize) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(value).map_err(|e| usage(e.to_string()))?;
    py.import("json")?.call_method1("loads", (text,))
}

/// Every tracker: its name and one line on what it does.
#[pyfunction]
fn trackers(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let dict = PyDict::new(py);
    registry::trackers().iter().try_for_each(|t| dict.set_item(t.name, t.summary))?;
    Ok(dict)
}

/// Every detector: its name and one line on what it finds.
#[pyfunction]
fn detectors(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let dict = PyDict::new(py);
    registry::detectors().iter().try_for_each(|d| dict.set_item(d.name, d.summary))?;
    Ok(dict)
}

/// Every parameter of a tracker, or of a detector: name, type, range, unit, source, meaning and default.
#[pyfunction]
#[pyo3(signature = (name, *, detector = false))]
fn parameters<'py>(py: Python<'py>, name: &str, detector: bool) -> PyResult<Bound<'py, PyAny>> {
    let schema = if detector {
        registry::detector(name).map_err(of_tracking)?.schema()
    } else {
        registry::tracker(name).map_err(of_tracking)?.default_recipe().schema()
    };
    to_python(py, &schema)
}
