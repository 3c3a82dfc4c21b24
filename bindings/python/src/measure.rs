//! `pursuit measure` and `pursuit calibrate` as functions.

use crate::errors::{of_run, usage};
use crate::registry::to_python;
use crate::values;
use numpy::PyArray1;
use pursuit::measure::{
    CalibrationOptions, Destination, MeasureOptions, calibration_of, measure as run, write_calibration,
};
use pursuit::measuring::{Calibration, Cells, Table};
use pursuit::{RunError, toml};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use std::path::PathBuf;

pub fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(measure, module)?)?;
    module.add_function(wrap_pyfunction!(calibrate, module)?)
}

/// Options of a kind from keyword arguments.
fn options<T: serde::de::DeserializeOwned>(given: &Bound<'_, PyDict>) -> PyResult<T> {
    let table: toml::Table = values::table(given)?;
    table.try_into().map_err(|e: toml::de::Error| usage(e.to_string().trim_end()))
}

/// What was found, the columns of measure.csv and of the events, and the files written.
type Found<'py> = (Bound<'py, PyAny>, Bound<'py, PyDict>, Bound<'py, PyDict>, Vec<PathBuf>);

/// Measures a run, and writes its files into `out` where that is given.
#[pyfunction]
fn measure<'py>(
    py: Python<'py>,
    path: PathBuf,
    ruler: &Bound<'py, PyDict>,
    how: &Bound<'py, PyDict>,
    out: Option<PathBuf>,
) -> PyResult<Found<'py>> {
    let (ruler, how): (CalibrationOptions, MeasureOptions) = (options(ruler)?, options(how)?);
    let found = py.detach(|| {
        let plots = how.plots != Some(false);
        let destination = out.as_deref().map(|out| Destination::new(out, &how.formats, plots)).transpose()?;
        let calibration = match ruler.is_silent() {
            true => None,
            false => Some(ruler.applied(calibration_of(&path, &how)?)?),
        };
        let found = run(&path, calibration, &how)?;
        let files = destination.map(|destination| destination.write(&found)).transpose()?;
        Ok((found, files.unwrap_or_default()))
    });
    let (found, files) = found.map_err(|e: RunError| of_run(&e))?;
    Ok((to_python(py, &found.facts)?, columns(py, &found.table())?, columns(py, &found.events_table())?, files))
}

/// Writes a calibration.
#[pyfunction]
fn calibrate(path: PathBuf, ruler: &Bound<'_, PyDict>, picture: Option<[usize; 2]>, overwrite: bool) -> PyResult<()> {
    let ruler: CalibrationOptions = options(ruler)?;
    let made = ruler.applied(Calibration { picture, ..Calibration::default() });
    made.and_then(|made| write_calibration(&made, &path, overwrite)).map_err(|e| of_run(&e))
}

/// Numbers as arrays, words as lists.
fn columns<'py>(py: Python<'py>, table: &Table) -> PyResult<Bound<'py, PyDict>> {
    let columns = PyDict::new(py);
    for column in &table.columns {
        match &column.cells {
            Cells::Whole(values) => columns.set_item(&column.name, PyArray1::from_slice(py, values))?,
            Cells::Number(values, _) => columns.set_item(&column.name, PyArray1::from_slice(py, values))?,
            Cells::Word(values) => columns.set_item(&column.name, PyList::new(py, values)?)?,
            Cells::Kind(values) => columns.set_item(&column.name, PyList::new(py, values)?)?,
        }
    }
    Ok(columns)
}
