//! Many targets, frame by frame.

use crate::errors::{of_run, of_tracking, usage, warn};
use crate::estimate::Estimate;
use crate::saved;
use crate::tracker::next_time;
use crate::values::{self, Ltwh, ltwh};
use pursuit::toml::Table;
use pursuit::trackers::registry;
use pursuit::tracking::many::Associating;
use pursuit::tracking::{MultiTracker as Targets, Recipe, TargetId, TargetSet, Track};
use pursuit::{Frame, RunConfig};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use serde::{Deserialize, Serialize};
use std::sync::{Mutex, PoisonError};

/// Follows many targets through frames given as arrays.
///
/// MultiTracker(tracker=None, *, detector=None, fps=30.0, channels="rgb", **parameters)
///
/// Without a detector each target is given by add and followed by a tracker of its own. With one, everything that it finds
/// is followed: targets are associated, born and dropped. parameters: of the tracker, and detect__key, many__key.
#[pyclass(frozen, module = "pursuit")]
pub struct MultiTracker {
    settings: Settings,
    recipe: Box<dyn Recipe>,
    running: Mutex<Running>,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
struct Settings {
    tracker: Option<String>,
    detector: Option<String>,
    parameters: Table,
    fps: f64,
    channels: String,
}

struct Running {
    targets: Box<dyn Targets>,
    /// The number that the next frame has.
    next: u64,
    /// The time of the frame seen last.
    time_s: f64,
}

const MAGIC: &[u8] = b"pursuit targets 1\n";

impl MultiTracker {
    fn make(settings: Settings, saved: Option<(u64, f64, &[u8])>) -> PyResult<Self> {
        let trackers = settings.tracker.iter().map(String::as_str);
        let parameters = Python::attach(|py| {
            crate::networks::located(py, settings.parameters.clone(), trackers, settings.detector.as_deref())
        });
        let config = RunConfig {
            tracker: settings.tracker.clone(),
            detect: settings.detector.clone(),
            many: settings.detector.as_ref().map(|_| true),
            parameters,
            ..RunConfig::default()
        };
        let methods = config.methods().map_err(|e| of_run(&e))?;
        Python::attach(|py| warn(py, &methods.notes))?;
        let recipe_of = |name: &str| registry::tracker(name).map(|entry| entry.default_recipe());
        let (next, time_s, state) = saved.map_or((0, 0.0, None), |(next, at, state)| (next, at, Some(state)));
        let targets: Result<Box<dyn Targets>, _> = match (methods.detector, state) {
            (None, None) => Ok(Box::new(TargetSet::new()) as _),
            (None, Some(state)) => TargetSet::restore(state, &recipe_of).map(|t| Box::new(t) as _),
            (Some(detector), Some(state)) => {
                let restored = Associating::restore(state, detector, &recipe_of);
                restored.map(|t| Box::new(t.with_embedder(methods.embedder)) as _)
            }
            (Some(detector), None) => Associating::new(detector, methods.many).map(|targets| {
                let targets = targets.with_embedder(methods.embedder);
                let looks = settings.tracker.is_some();
                Box::new(if looks { targets.with_appearance(methods.recipe.boxed_clone()) } else { targets }) as _
            }),
        };
        let running = Mutex::new(Running { targets: targets.map_err(of_tracking)?, next, time_s });
        Ok(Self { settings, recipe: methods.recipe, running })
    }

    /// Works on the targets with the interpreter released, also while it waits for another thread's call.
    fn locked<T: Send>(&self, py: Python<'_>, work: impl FnOnce(&mut Running) -> T + Send) -> T {
        py.detach(|| work(&mut self.running.lock().unwrap_or_else(PoisonError::into_inner)))
    }

    fn frame(
        &self,
        time_s: Option<f64>,
        array: &Bound<'_, PyAny>,
        depth: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Frame> {
        crate::pixels::frame(0, time_s.unwrap_or(0.0), array, depth, &self.settings.channels)
    }
}

#[pymethods]
impl MultiTracker {
    #[new]
    #[pyo3(signature = (tracker = None, *, detector = None, fps = 30.0, channels = "rgb", **parameters))]
    fn new(
        tracker: Option<String>,
        detector: Option<String>,
        fps: f64,
        channels: &str,
        parameters: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        if !(fps.is_finite() && fps > 0.0) {
            return Err(usage(format!("fps is {fps}; give frames per second, above 0")));
        }
        let name = tracker.as_deref().unwrap_or(registry::DEFAULT_TRACKER);
        let schema = registry::tracker(name).map_err(of_tracking)?.default_recipe().schema();
        let parameters = values::parameters(parameters, &schema)?;
        Self::make(Settings { tracker, detector, parameters, fps, channels: channels.to_owned() }, None)
    }

    /// Follows the target inside box of `frame`, the frame given to update last, or the first; returns its number, from 1.
    ///
    /// time_s: that frame's time in seconds; without, that of the frame given to update last.
    #[pyo3(signature = (frame, r#box, *, time_s = None, depth = None))]
    fn add(
        &self,
        py: Python<'_>,
        frame: &Bound<'_, PyAny>,
        r#box: &Bound<'_, PyAny>,
        time_s: Option<f64>,
        depth: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<u64> {
        let (frame, bbox) = (self.frame(time_s, frame, depth)?, values::bbox(r#box)?);
        let added = self.locked(py, |r| -> pursuit::tracking::Result<TargetId> {
            let (index, at) = (r.next.saturating_sub(1), time_s.unwrap_or(r.time_s));
            let id = r.targets.add(&*self.recipe, &frame.clone().retimed(index, at), bbox)?;
            (r.next, r.time_s) = (r.next.max(1), at);
            Ok(id)
        });
        Ok(added.map_err(of_tracking)?.0)
    }

    /// Stops following a target. Raises UsageError where there is none of that number.
    fn remove(&self, py: Python<'_>, target: u64) -> PyResult<()> {
        self.locked(py, |r| r.targets.remove(TargetId(target))).map_err(of_tracking)
    }

    /// Looks at the next frame: an Estimate for every target that is known, in order of their numbers.
    #[pyo3(signature = (frame, *, time_s = None, depth = None))]
    fn update(
        &self,
        py: Python<'_>,
        frame: &Bound<'_, PyAny>,
        time_s: Option<f64>,
        depth: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Vec<Estimate>> {
        let frame = self.frame(time_s, frame, depth)?;
        let (index, tracks) = self
            .locked(py, |r| {
                let index = r.next;
                let at = time_s.unwrap_or_else(|| next_time(index, r.time_s, self.settings.fps));
                let mut tracks: Vec<Track> = Vec::new();
                r.targets.step(&frame.clone().retimed(index, at), &mut tracks)?;
                (r.next, r.time_s) = (index + 1, at);
                Ok((index, tracks))
            })
            .map_err(of_tracking)?;
        let known = |t: Track| {
            let elapsed = Some(t.elapsed.wall_ms);
            Some(Estimate::new(index, t.id.0, elapsed, t.estimate?).of_class(t.class))
        };
        Ok(tracks.into_iter().filter_map(known).collect())
    }

    /// Where a target will be `seconds` after the frame seen last: (left, top, width, height) in pixels.
    fn forecast(&self, py: Python<'_>, target: u64, seconds: f64) -> PyResult<Ltwh> {
        let forecast = self.locked(py, |r| r.targets.forecast(TargetId(target), seconds)).map_err(of_tracking)?;
        Ok(ltwh(forecast.bbox))
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

    /// Targets as save left them. Raises StateError for bytes that another program or version wrote.
    #[staticmethod]
    fn restore(saved: &[u8]) -> PyResult<Self> {
        let ((settings, next, at), state): ((Settings, u64, f64), _) = saved::read(MAGIC, saved)?;
        if !(settings.fps.is_finite() && settings.fps > 0.0 && at.is_finite()) {
            return Err(saved::broken());
        }
        Self::make(settings, Some((next, at, state)))
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        Ok((slf.getattr("restore")?, (slf.get().save(slf.py())?,)))
    }

    fn __repr__(&self) -> String {
        let s = &self.settings;
        format!("MultiTracker({:?}, detector={:?})", s.tracker.as_deref().unwrap_or("pursuit"), s.detector)
    }
}
