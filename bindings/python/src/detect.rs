//! Detectors, a frame at a time.

use crate::errors::of_tracking;
use crate::values::{self, Ltwh, ltwh};
use pursuit::trackers::registry;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::{Mutex, PoisonError};

/// Finds targets without being told where to look.
///
/// Detector(name, *, channels="rgb", fps=30.0, **parameters)
///
/// name: one of pursuit.detectors. A detector that models the scene ("motion") wants every frame of one camera.
#[pyclass(frozen, module = "pursuit")]
pub struct Detector {
    name: &'static str,
    channels: String,
    fps: f64,
    state: Mutex<(Box<dyn pursuit::tracking::Detector>, u64)>,
}

#[pymethods]
impl Detector {
    #[new]
    #[pyo3(signature = (name, *, channels = "rgb", fps = 30.0, **parameters))]
    fn new(
        py: Python<'_>,
        name: &str,
        channels: &str,
        fps: f64,
        parameters: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let entry = registry::detector(name).map_err(of_tracking)?;
        let parameters = values::parameters(parameters, &entry.schema())?;
        let parameters = crate::networks::located(py, parameters, std::iter::empty(), Some(name));
        let detector = entry.detector(&parameters).map_err(of_tracking)?;
        crate::errors::warn(py, &detector.notes())?;
        Ok(Self { name: entry.name, channels: channels.to_owned(), fps, state: Mutex::new((detector, 0)) })
    }

    /// Name in the registry.
    #[getter]
    fn name(&self) -> &str {
        self.name
    }

    /// What is in this frame, the best first: a list of (box, confidence); box is left, top, width, height in pixels,
    /// confidence 0 to 1.
    #[pyo3(signature = (frame, *, time_s = None, depth = None))]
    fn detect(
        &self,
        py: Python<'_>,
        frame: &Bound<'_, PyAny>,
        time_s: Option<f64>,
        depth: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Vec<(Ltwh, f64)>> {
        let frame = crate::pixels::frame(0, time_s.unwrap_or(0.0), frame, depth, &self.channels)?;
        let found = py.detach(|| {
            let (detector, next) = &mut *self.state.lock().unwrap_or_else(PoisonError::into_inner);
            let at = time_s.unwrap_or(*next as f64 / self.fps);
            let found = detector.detect(&frame.clone().retimed(*next, at), &[]);
            *next += 1;
            found
        });
        Ok(found.map_err(of_tracking)?.into_iter().map(|d| (ltwh(d.bbox), d.confidence)).collect())
    }

    fn __repr__(&self) -> String {
        format!("Detector({:?})", self.name)
    }
}
