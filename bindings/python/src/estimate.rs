//! What is known of a target after a frame.

use crate::values::{Ltwh, ltwh};
use numpy::{PyArray2, PyArrayMethods};
use pursuit::tracking::{BoxCovariance, Class};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// What a tracker says about one target in one frame. Boxes are (left, top, width, height) in pixels.
#[pyclass(frozen, module = "pursuit")]
pub struct Estimate {
    /// Number of the frame, from 0.
    #[pyo3(get)]
    frame: u64,
    /// The target, counted from 1.
    #[pyo3(get)]
    target: u64,
    /// Milliseconds that the update took, where it was measured.
    #[pyo3(get)]
    update_ms: Option<f64>,
    class: Option<Class>,
    inner: pursuit::Estimate,
}

impl Estimate {
    /// Of a target that no detector named.
    pub fn new(frame: u64, target: u64, update_ms: Option<f64>, inner: pursuit::Estimate) -> Self {
        Self { frame, target, update_ms, class: None, inner }
    }

    /// The same of a target that is one of `class`.
    pub fn of_class(self, class: Option<Class>) -> Self {
        Self { class, ..self }
    }
}

/// A covariance as an array of 4 x 4.
pub fn covariance(py: Python<'_>, matrix: Option<BoxCovariance>) -> PyResult<Option<Bound<'_, PyArray2<f64>>>> {
    let Some(matrix) = matrix else { return Ok(None) };
    let array = PyArray2::<f64>::zeros(py, [4, 4], false);
    {
        let mut values = array.try_readwrite().map_err(|e| crate::errors::usage(e.to_string()))?;
        let mut values = values.as_array_mut();
        for row in 0..4 {
            for column in 0..4 {
                values[[row, column]] = matrix[(row, column)];
            }
        }
    }
    Ok(Some(array))
}

#[pymethods]
impl Estimate {
    /// Time of the frame, in seconds.
    #[getter]
    fn time_s(&self) -> f64 {
        self.inner.time_s
    }

    /// Where the target is believed to be: corrected when tracking or unsure, predicted when occluded, last believed when lost.
    #[getter]
    fn r#box(&self) -> Ltwh {
        ltwh(self.inner.bbox)
    }

    /// The probability, 0 to 1, that `box` overlaps the target by at least one half.
    #[getter]
    fn score(&self) -> f64 {
        self.inner.score
    }

    /// "tracking" (measured in this frame), "unsure" (in sight, not for certain), "occluded" (hidden or not found, searched near) or "lost" (not to be steered by).
    #[getter]
    fn state(&self) -> &'static str {
        self.inner.state.as_str()
    }

    /// What the target is, as a detector that tells kinds of things apart has it ("person"), or None.
    #[getter]
    fn class_name(&self) -> Option<&str> {
        self.class.as_ref().map(Class::as_str)
    }

    /// Why it is not tracked: "covered", "changed" (something is there that looks otherwise), "confused" (several things could be it)
    /// or "gone"; None while it is tracked, and where the method cannot tell.
    #[getter]
    fn doubt(&self) -> Option<&'static str> {
        self.inner.doubt.map(pursuit::Doubt::as_str)
    }

    /// The one-step prior, made before the frame was seen, or None.
    #[getter]
    fn prediction(&self) -> Option<Ltwh> {
        self.inner.prediction.map(ltwh)
    }

    /// What was measured in this frame, believed or not, or None.
    #[getter]
    fn measurement(&self) -> Option<Ltwh> {
        self.inner.measurement.map(ltwh)
    }

    /// Covariance of centre x, centre y, width and height, 4 x 4 in square pixels, or None.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        covariance(py, self.inner.covariance)
    }

    /// Velocity of the centre (x, y) in pixels per second, or None.
    #[getter]
    fn velocity(&self) -> Option<(f64, f64)> {
        self.inner.velocity.map(|v| (v.x, v.y))
    }

    /// Raw figures of the method: peaks, ratios, areas.
    #[getter]
    fn diagnostics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        self.inner.diagnostics.iter().try_for_each(|(name, value)| dict.set_item(name, value))?;
        Ok(dict)
    }

    fn __repr__(&self) -> String {
        let b = self.inner.bbox;
        format!(
            "Estimate(frame={}, target={}, state='{}', score={:.3}, box=({:.2}, {:.2}, {:.2}, {:.2}))",
            self.frame,
            self.target,
            self.inner.state,
            self.inner.score,
            b.left(),
            b.top(),
            b.width(),
            b.height()
        )
    }
}
