//! One target, frame by frame.

use crate::errors::{StateError, of_tracking, usage};
use crate::estimate::{self, Estimate};
use crate::saved;
use crate::values::{self, Ltwh, ltwh};
use numpy::PyArray2;
use pursuit::toml::Table;
use pursuit::trackers::registry;
use pursuit::tracking::{Recipe, TrackingError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use serde::{Deserialize, Serialize};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Follows one target through frames given as arrays.
///
/// Tracker(name="pursuit", *, fps=30.0, channels="rgb", **parameters)
///
/// name: one of pursuit.trackers. fps: frames per second, for frames given without time_s. channels: "rgb" or "bgr", the
/// order of colours in frames of shape (height, width, 3). parameters: see help(pursuit.trackers[name]); a word given for a
/// group chooses its model, motion="imm", and a parameter of a group is motion__model or a dict.
///
/// Raises UsageError for a name that there is not, a parameter that there is not, or a value out of range.
#[pyclass(frozen, subclass, module = "pursuit")]
pub struct Tracker {
    settings: Settings,
    recipe: Box<dyn Recipe>,
    running: Mutex<Running>,
}

/// What the tracker was made with.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Settings {
    name: String,
    parameters: Table,
    fps: f64,
    bgr: bool,
}

#[derive(Default)]
struct Running {
    tracker: Option<Box<dyn pursuit::Tracker>>,
    /// The number that the next frame has.
    next: u64,
    /// The time of the frame seen last.
    time_s: f64,
}

/// What `save` writes before the tracker's own state.
#[derive(Serialize, Deserialize)]
struct Header {
    settings: Settings,
    next: u64,
    time_s: f64,
    started: bool,
}

/// What a saved tracker begins with.
const MAGIC: &[u8] = b"pursuit tracker 1\n";

const NOT_STARTED: &str = "the tracker has no target yet; call init(frame, box) first";

impl Settings {
    fn channels(&self) -> &'static str {
        if self.bgr { "bgr" } else { "rgb" }
    }

    fn recipe(&self) -> Result<Box<dyn Recipe>, TrackingError> {
        registry::tracker(&self.name)?.recipe(&self.parameters)
    }
}

impl Tracker {
    fn with(settings: Settings, running: Running) -> PyResult<Self> {
        let recipe = settings.recipe().map_err(of_tracking)?;
        Ok(Self { settings, recipe, running: Mutex::new(running) })
    }

    /// Waits for another thread's call with the interpreter released: that call may need it to end.
    fn locked<T: Send>(&self, py: Python<'_>, work: impl FnOnce(&mut Running) -> T + Send) -> T {
        py.detach(|| work(&mut self.lock()))
    }

    fn lock(&self) -> MutexGuard<'_, Running> {
        self.running.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn frame(
        &self,
        index: u64,
        time_s: Option<f64>,
        array: &Bound<'_, PyAny>,
        depth: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<pursuit::Frame> {
        let time_s = time_s.unwrap_or(index as f64 / self.settings.fps);
        crate::pixels::frame(index, time_s, array, depth, self.settings.channels())
    }
}

impl Running {
    fn started(&mut self) -> PyResult<&mut dyn pursuit::Tracker> {
        match &mut self.tracker {
            Some(tracker) => Ok(&mut **tracker),
            None => Err(StateError::new_err(NOT_STARTED)),
        }
    }
}

/// The time of frame `index` when none is given: a step after the last; exactly `index / fps` as long as none ever was.
pub fn next_time(index: u64, last_s: f64, fps: f64) -> f64 {
    match index.checked_sub(1) {
        None => 0.0,
        Some(before) if last_s == before as f64 / fps => index as f64 / fps,
        Some(_) => last_s + 1.0 / fps,
    }
}

#[pymethods]
impl Tracker {
    #[new]
    #[pyo3(signature = (name = "pursuit", *, fps = 30.0, channels = "rgb", **parameters))]
    fn new(
        py: Python<'_>,
        name: &str,
        fps: f64,
        channels: &str,
        parameters: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let entry = registry::tracker(name).map_err(of_tracking)?;
        if !(fps.is_finite() && fps > 0.0) {
            return Err(usage(format!("fps is {fps}; give frames per second, above 0")));
        }
        let bgr = match channels {
            "rgb" => false,
            "bgr" => true,
            other => return Err(usage(format!("channels `{other}`: give \"rgb\" or \"bgr\""))),
        };
        let parameters = values::parameters(parameters, &entry.default_recipe().schema())?;
        let parameters = crate::networks::located(py, parameters, std::iter::once(name), None);
        Self::with(Settings { name: name.to_owned(), parameters, fps, bgr }, Running::default())
    }

    /// Name in the registry.
    #[getter]
    fn name(&self) -> &str {
        &self.settings.name
    }

    /// Every parameter with its value, groups as dicts.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        crate::registry::to_python(py, &self.recipe.parameters().map_err(of_tracking)?)
    }

    /// Starts on the target inside box = (left, top, width, height), pixels, of this frame; also on another target later.
    ///
    /// frame: uint8 (height, width) or (height, width, 3), or uint16 (height, width). time_s: seconds; without, the
    /// frame's number over fps. depth: uint16 (height, width) in millimetres, 0 where there is none. Nothing is copied
    /// where pixels follow each other without gaps. Raises UsageError for a box that is empty or outside the frame,
    /// InputError for an array that is no frame.
    #[pyo3(signature = (frame, r#box, *, time_s = None, depth = None))]
    fn init(
        &self,
        py: Python<'_>,
        frame: &Bound<'_, PyAny>,
        r#box: &Bound<'_, PyAny>,
        time_s: Option<f64>,
        depth: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Estimate> {
        let (frame, bbox) = (self.frame(0, time_s, frame, depth)?, values::bbox(r#box)?);
        let started = py.detach(|| self.recipe.init(&frame, bbox)).map_err(of_tracking)?;
        let at = frame.time_s();
        self.locked(py, |running| *running = Running { tracker: Some(started), next: 1, time_s: at });
        Ok(Estimate::new(0, 1, None, pursuit::Estimate::started(at, bbox, 1.0)))
    }

    /// Looks at the next frame, of the size of the first, and says where the target is. Losing it is a state, no error.
    ///
    /// frame, depth: as for init. time_s: seconds, after those of the frame before; without, a step of 1 / fps.
    /// Raises InputError for a frame of another size, StateError before init.
    #[pyo3(signature = (frame, *, time_s = None, depth = None))]
    fn update(
        &self,
        py: Python<'_>,
        frame: &Bound<'_, PyAny>,
        time_s: Option<f64>,
        depth: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Estimate> {
        // The number and the default time are settled under the lock; the pixels are looked at before, with the interpreter.
        let frame = self.frame(0, Some(time_s.unwrap_or(0.0)), frame, depth)?;
        let (index, estimate) = self.locked(py, |running| -> PyResult<_> {
            let index = running.next;
            let at = time_s.unwrap_or_else(|| next_time(index, running.time_s, self.settings.fps));
            let frame = frame.clone().retimed(index, at);
            let estimate = running.started()?.update(&frame).map_err(of_tracking)?;
            (running.next, running.time_s) = (index + 1, at);
            Ok((index, estimate))
        })?;
        Ok(Estimate::new(index, 1, None, estimate))
    }

    /// Where the target will be `seconds` after the frame seen last, by its motion alone; changes nothing.
    ///
    /// Returns (box, covariance, velocity): left, top, width, height in pixels; 4 x 4 in square pixels or None; pixels per
    /// second or None.
    #[allow(clippy::type_complexity, reason = "a tuple of Python")]
    fn forecast<'py>(
        &self,
        py: Python<'py>,
        seconds: f64,
    ) -> PyResult<(Ltwh, Option<Bound<'py, PyArray2<f64>>>, Option<(f64, f64)>)> {
        let forecast = self.locked(py, |r| r.started()?.forecast(seconds).map_err(of_tracking))?;
        let covariance = estimate::covariance(py, forecast.covariance)?;
        Ok((ltwh(forecast.bbox), covariance, forecast.velocity.map(|v| (v.x, v.y))))
    }

    /// Changes parameters of the groups motion, policy and search while running; what is known of the target stays.
    #[pyo3(signature = (**parameters))]
    fn change(&self, py: Python<'_>, parameters: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        let changes = values::parameters(parameters, &self.recipe.schema())?;
        self.locked(py, |r| r.started()?.change(&changes).map_err(of_tracking))
    }

    /// Everything needed to go on later, as bytes for restore.
    fn save<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = self.locked(py, |running| -> PyResult<Vec<u8>> {
            let state = running.tracker.as_ref().map(|t| t.save()).transpose().map_err(of_tracking)?;
            let (next, time_s, started) = (running.next, running.time_s, state.is_some());
            let header = Header { settings: self.settings.clone(), next, time_s, started };
            saved::write(MAGIC, &header, state.as_deref().unwrap_or_default())
        })?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// A tracker as save left it. Raises StateError for bytes that another program or version wrote.
    #[staticmethod]
    fn restore(py: Python<'_>, saved: &[u8]) -> PyResult<Self> {
        let (header, state): (Header, _) = saved::read(MAGIC, saved)?;
        if !(header.settings.fps.is_finite() && header.settings.fps > 0.0 && header.time_s.is_finite()) {
            return Err(saved::broken());
        }
        let made = Self::with(header.settings, Running::default())?;
        if header.started {
            let tracker = py.detach(|| made.recipe.restore(state)).map_err(of_tracking)?;
            *made.lock() = Running { tracker: Some(tracker), next: header.next, time_s: header.time_s };
        }
        Ok(made)
    }

    fn __copy__(&self, py: Python<'_>) -> PyResult<Self> {
        let running = self.locked(py, |r| Running {
            tracker: r.tracker.as_ref().map(|t| t.boxed_clone()),
            next: r.next,
            time_s: r.time_s,
        });
        Self::with(self.settings.clone(), running)
    }

    fn __deepcopy__(&self, py: Python<'_>, _memo: &Bound<'_, PyAny>) -> PyResult<Self> {
        self.__copy__(py)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        Ok((slf.getattr("restore")?, (slf.get().save(slf.py())?,)))
    }

    fn __repr__(&self) -> String {
        format!("Tracker({:?}, fps={})", self.settings.name, self.settings.fps)
    }
}
