//! Detections of anybody's detector as arrays, associated frame by frame.

mod given;
mod tracks;

use crate::errors::{of_run, of_tracking, usage};
use crate::saved;
use crate::tracker::next_time;
use crate::values;
use given::Given;
use pursuit::Frame;
use pursuit::associate::Associate;
use pursuit::geometry::Size;
use pursuit::inference::onnx::Device;
use pursuit::parameters::ParameterError;
use pursuit::toml::Table;
use pursuit::trackers::embedding::embedder;
use pursuit::tracking::many::Associating;
use pursuit::tracking::{MultiTracker as _, TrackingError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use serde::{Deserialize, Serialize};
use std::sync::{Mutex, PoisonError};
use tracks::Told;
pub use tracks::Tracks;

/// Makes tracks of the boxes that a detector of your own finds, frame by frame.
///
/// Associator(*, size=None, fps=30.0, channels="rgb", preset=None, device="cpu", **parameters)
///
/// size: (width, height) of the picture in pixels, by which it is known that a target has left it; None where that is not known. fps: frames a second,
/// for updates without time_s. channels: "rgb" or "bgr", of frames given to update. preset: "sort", "bytetrack", "ocsort", "botsort" or "cbiou", a
/// published way to associate in place of our own defaults. device: what a network by file that tells looks apart (embedding__model="network") runs on,
/// "cpu", "cuda", "tensorrt", "openvino" or "coreml". parameters: those of the group `many`, association="buffered",
/// birth__ratio__even=0.5; see docs/guide/targets.md.
///
/// Raises UsageError for a parameter that there is not, or a value out of range.
#[pyclass(frozen, module = "pursuit")]
pub struct Associator {
    settings: Settings,
    running: Mutex<Running>,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
struct Settings {
    parameters: Table,
    size: Option<(usize, usize)>,
    fps: f64,
    channels: String,
    device: Device,
}

impl Settings {
    fn are_sound(&self) -> bool {
        self.fps.is_finite() && self.fps > 0.0 && self.size.is_none_or(|(width, height)| width > 0 && height > 0)
    }
}

struct Running {
    targets: Associating,
    /// The number that the next frame has.
    next: u64,
    /// The time of the frame seen last.
    time_s: f64,
}

const MAGIC: &[u8] = b"pursuit associator 2\n";

impl Associator {
    fn of(settings: Settings, targets: Associating, next: u64, time_s: f64) -> Self {
        Self { settings, running: Mutex::new(Running { targets, next, time_s }) }
    }

    /// Works on the targets with the interpreter released, also while it waits for another thread's call.
    fn locked<T: Send>(&self, py: Python<'_>, work: impl FnOnce(&mut Running) -> T + Send) -> T {
        py.detach(|| work(&mut self.running.lock().unwrap_or_else(PoisonError::into_inner)))
    }
}

impl Running {
    fn update(
        &mut self,
        settings: &Settings,
        time_s: Option<f64>,
        frame: Option<Frame>,
        given: &Given,
    ) -> Result<Told, TrackingError> {
        let (index, size) = (self.next, settings.size.map(|(width, height)| Size::new(width, height)));
        let at = time_s.unwrap_or_else(|| next_time(index, self.time_s, settings.fps));
        let tracks = match frame {
            Some(frame) => self.targets.update_in(&frame.retimed(index, at), &given.detections)?,
            None => self.targets.update(at, size, &given.detections)?,
        };
        let told = Told::of(tracks);
        (self.next, self.time_s) = (index + 1, at);
        Ok(told)
    }
}

#[pymethods]
impl Associator {
    #[new]
    #[pyo3(signature = (*, size = None, fps = 30.0, channels = "rgb", preset = None, device = "cpu", **parameters))]
    fn new(
        size: Option<(usize, usize)>,
        fps: f64,
        channels: &str,
        preset: Option<&str>,
        device: &str,
        parameters: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let preset = preset.map(str::parse).transpose().map_err(|e: ParameterError| usage(e.to_string()))?;
        let given = values::parameters(parameters, &given::schema())?;
        let Some(&device) = Device::ALL.iter().find(|known| known.as_str() == device) else {
            let all: Vec<_> = Device::ALL.iter().map(|known| known.as_str()).collect();
            return Err(usage(format!("device is one of {}, not `{device}`", all.join(", "))));
        };
        let settings = Settings { parameters: given, size, fps, channels: channels.to_owned(), device };
        if !settings.are_sound() {
            return Err(usage("fps is a number above 0, size the width and height of the picture in pixels"));
        }
        let prefixed = settings.parameters.iter().map(|(key, value)| (format!("many.{key}"), value.clone()));
        let options = Associate { preset, parameters: prefixed.collect(), ..Associate::default() };
        let params = options.params().map_err(|e| of_run(&e))?;
        let looks = embedder(&params.embedding, device).map_err(of_tracking)?;
        let targets = Associating::fed(params).map_err(of_tracking)?.with_embedder(looks);
        Ok(Self::of(settings, targets, 0, 0.0))
    }

    /// Takes the detections of the next frame and returns Tracks: what is known of every target now, as arrays.
    ///
    /// boxes: (n, 4), left, top, width, height in pixels; with corners=True left, top, right, bottom. scores: (n,), confidences in [0, 1]; 1 without.
    /// classes: (n,), whole numbers; below 0: not known. embeddings: (n, d), what each box looks like; a row with NaN has none.
    /// time_s: seconds, not before the frame before; without, a step of 1 / fps. frame: the picture, for the camera's motion (motion__camera="flow") and looks (embedding__model="colors").
    ///
    /// Raises UsageError for arrays whose shapes do not fit or a time that runs backward, InputError for a box that is not finite or a score outside of [0, 1];
    /// everything is then as before.
    #[pyo3(signature = (boxes, scores = None, classes = None, embeddings = None, *, corners = false, time_s = None, frame = None))]
    #[allow(clippy::too_many_arguments, reason = "keywords of Python")]
    fn update(
        &self,
        py: Python<'_>,
        boxes: &Bound<'_, PyAny>,
        scores: Option<&Bound<'_, PyAny>>,
        classes: Option<&Bound<'_, PyAny>>,
        embeddings: Option<&Bound<'_, PyAny>>,
        corners: bool,
        time_s: Option<f64>,
        frame: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Tracks> {
        let given = Given::read(boxes, corners, scores, classes, embeddings)?;
        let frame = frame.map(|f| crate::pixels::frame(0, 0.0, f, None, &self.settings.channels)).transpose()?;
        let told = self.locked(py, |r| r.update(&self.settings, time_s, frame, &given)).map_err(of_tracking)?;
        told.arrays(py)
    }

    /// Where a target will be `seconds` after the last update: (left, top, width, height) in pixels.
    fn forecast(&self, py: Python<'_>, target: u64, seconds: f64) -> PyResult<values::Ltwh> {
        let id = pursuit::tracking::TargetId(target);
        let forecast = self.locked(py, |r| r.targets.forecast(id, seconds)).map_err(of_tracking)?;
        Ok(values::ltwh(forecast.bbox))
    }

    /// The numbers of the targets that are followed.
    #[getter]
    fn targets(&self, py: Python<'_>) -> Vec<u64> {
        self.locked(py, |r| r.targets.ids().into_iter().map(|id| id.0).collect())
    }

    /// Everything needed to go on later, as bytes for restore.
    fn save<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let (next, at, state) =
            self.locked(py, |r| r.targets.save().map(|s| (r.next, r.time_s, s))).map_err(of_tracking)?;
        Ok(PyBytes::new(py, &saved::write(MAGIC, &(&self.settings, next, at), &state)?))
    }

    /// An associator as save left it. Raises StateError for bytes that another program or version wrote.
    #[staticmethod]
    fn restore(saved: &[u8]) -> PyResult<Self> {
        let ((settings, next, at), state): ((Settings, u64, f64), _) = saved::read(MAGIC, saved)?;
        if !(settings.are_sound() && at.is_finite()) {
            return Err(saved::broken());
        }
        let recipe_of = |name: &str| pursuit::trackers::registry::tracker(name).map(|entry| entry.default_recipe());
        let targets = Associating::restore_fed(state, &recipe_of).map_err(of_tracking)?;
        let looks = embedder(&targets.params().embedding, settings.device).map_err(of_tracking)?;
        let targets = targets.with_embedder(looks);
        Ok(Self::of(settings, targets, next, at))
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        Ok((slf.getattr("restore")?, (slf.get().save(slf.py())?,)))
    }

    fn __repr__(&self) -> String {
        let size = self.settings.size.map_or_else(|| "None".to_owned(), |size| format!("{size:?}"));
        format!("Associator(size={size}, fps={})", self.settings.fps)
    }
}
