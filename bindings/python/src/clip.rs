//! A whole input, tracked as the command does it, on a thread of its own.

use crate::errors::{PursuitError, of_run, usage};
use crate::estimate::Estimate;
use crate::iterated::{self, Iterated};
use crate::strip::Strip;
use crate::values;
use pursuit::media::OpenOptions;
use pursuit::{Progress, Record, Remote, Run, RunConfig, RunError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use serde::Deserialize;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Frames that may be tracked ahead of whoever iterates.
const AHEAD: usize = 64;
/// How often a wait looks for Ctrl-C.
const BREATH: Duration = Duration::from_millis(100);
/// The estimates of one input, frame by frame; what `pursuit.track` iterates over.
#[pyclass(frozen, module = "pursuit")]
pub struct Clip {
    news: Mutex<Receiver<News>>,
    /// What the run asks for frames, where Python has them; taken out while it answers.
    iterated: Mutex<Option<Iterated>>,
    remote: Remote,
    frame_count: Option<u64>,
    size: (usize, usize),
    strip: Arc<Mutex<Strip>>,
    state: Mutex<State>,
}

/// Pictures of a clip: (frame, JPEG) each, and (left, top, x, y) of them all.
type Pictures<'py> = (Vec<(u64, Bound<'py, PyBytes>)>, [f64; 4]);

/// What the thread says.
enum News {
    Rows(Vec<Record>),
    /// The next frame is wanted.
    Wanted,
    Over(Box<Result<(String, Option<RunError>), RunError>>),
}

#[derive(Default)]
struct State {
    facts: Option<String>,
    /// What Python raised when it was asked for a frame.
    raised: Option<PyErr>,
    over: bool,
}

#[pymethods]
impl Clip {
    /// Prepares a run from the keys of a configuration file; with `out` it leaves the files of `pursuit track` there. Frames,
    /// and depth images that belong to them, may be given in place of an input; they are iterated over by `next`.
    #[new]
    #[pyo3(signature = (frames = None, *, depths = None, channels = "rgb", **config))]
    fn new(
        py: Python<'_>,
        frames: Option<&Bound<'_, PyAny>>,
        depths: Option<&Bound<'_, PyAny>>,
        channels: &str,
        config: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let table = config.map(values::table).transpose()?.unwrap_or_default();
        let config = RunConfig::deserialize(table)
            .map_err(|e| usage(e.to_string().lines().next().unwrap_or_default().to_owned()))?;
        let trackers = config.tracker.iter().chain(&config.compare).map(String::as_str);
        let parameters = crate::networks::located(py, config.parameters.clone(), trackers, config.detect.as_deref());
        let config = RunConfig { parameters, ..config };
        let written = config.out.is_some();
        let (speak, news) = sync_channel(AHEAD);
        let ask = speak.clone();
        let given = frames.map(|frames| {
            iterated::source(frames, depths, channels, config.fps, move || ask.send(News::Wanted).is_ok())
        });
        let (iterated, source) = given.transpose()?.unzip();
        let options = OpenOptions::from_env();
        let prepare = || match source {
            Some(source) => Run::prepare_source(config, source, &options),
            None => Run::prepare(config, &options),
        };
        let run = py.detach(prepare).map_err(|e| of_run(&e))?;
        crate::errors::warn(py, run.notes())?;
        let run = if written { run } else { run.unwritten() };
        let (remote, frame_count, size) = (run.remote(), run.frame_count(), run.input().size);
        let strip = Arc::new(Mutex::new(Strip::default()));
        let kept = Arc::clone(&strip);
        let spawned = std::thread::Builder::new().name("pursuit".into()).spawn(move || follow(run, &speak, &kept));
        spawned.map_err(|e| PursuitError::new_err(format!("no thread can be started: {e}")))?;
        let (news, iterated, state) = (Mutex::new(news), Mutex::new(iterated), Mutex::default());
        Ok(Self { news, iterated, remote, frame_count, size: (size.width, size.height), strip, state })
    }

    /// How many frames there will be, where the input knows.
    #[getter]
    fn frame_count(&self) -> Option<u64> {
        self.frame_count
    }

    /// Width and height of the frames looked at, in pixels.
    #[getter]
    fn size(&self) -> (usize, usize) {
        self.size
    }

    /// What run.json holds, as JSON; None before the end.
    #[getter]
    fn facts(&self) -> Option<String> {
        self.state().facts.clone()
    }

    /// Small pictures of frames spread evenly over what was followed so far, at most 48: their frames' numbers and JPEG files;
    /// and (left, top, x, y): where they lie in the input, and how many pixels of the input one of theirs is.
    #[getter]
    fn pictures<'py>(&self, py: Python<'py>) -> Pictures<'py> {
        let strip = self.strip.lock().unwrap_or_else(PoisonError::into_inner);
        let pictures = strip.pictures().iter().map(|(frame, jpeg)| (*frame, PyBytes::new(py, jpeg)));
        (pictures.collect(), strip.place())
    }

    /// The estimates of the next frame, in order of the targets' numbers; None after the last.
    fn next(&self, py: Python<'_>) -> PyResult<Option<Vec<Estimate>>> {
        loop {
            if self.state().over {
                return Ok(None);
            }
            let news = py.detach(|| self.news.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(BREATH));
            match news {
                Ok(News::Rows(rows)) => {
                    let known = rows.into_iter().filter_map(|row| {
                        Some(Estimate::new(row.frame, row.target.0, row.update_ms, row.estimate?).of_class(row.class))
                    });
                    return Ok(Some(known.collect()));
                }
                Ok(News::Wanted) => self.answer(py),
                Ok(News::Over(end)) => return self.end(*end),
                Err(RecvTimeoutError::Timeout) => py.check_signals()?,
                Err(RecvTimeoutError::Disconnected) => {
                    self.state().over = true;
                    return Err(PursuitError::new_err("the tracking thread broke off; this is a defect of pursuit"));
                }
            }
        }
    }

    /// Ends the run after the frame in hand; files are closed properly.
    fn stop(&self) {
        self.remote.stop();
    }
}

impl Clip {
    fn state(&self) -> std::sync::MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Asks Python for the next frame, with nothing locked: it may call this clip.
    fn answer(&self, py: Python<'_>) {
        let slot = || self.iterated.lock().unwrap_or_else(PoisonError::into_inner);
        let taken = slot().take();
        if let Some(mut iterated) = taken {
            if let Err(raised) = iterated.answer(py) {
                self.state().raised = Some(raised);
            }
            *slot() = Some(iterated);
        }
    }

    fn end(&self, end: Result<(String, Option<RunError>), RunError>) -> PyResult<Option<Vec<Estimate>>> {
        let mut state = self.state();
        state.over = true;
        let (facts, failure) = end.map_err(|e| of_run(&e))?;
        state.facts = Some(facts);
        // What Python raised is what ended the run.
        let raised = state.raised.take();
        raised.or_else(|| failure.map(|error| of_run(&error))).map_or(Ok(None), Err)
    }
}

impl Drop for Clip {
    fn drop(&mut self) {
        // Nobody listens any more; the thread ends with its next frame.
        self.remote.stop();
    }
}

/// Runs to the end and says everything; where nobody listens, it was stopped.
fn follow(run: Run, speak: &SyncSender<News>, strip: &Mutex<Strip>) {
    let view = run.input().view;
    let remote = run.remote();
    let finished = run.run(|Progress { frame, records, .. }| {
        strip.lock().unwrap_or_else(PoisonError::into_inner).note(frame, view);
        if speak.send(News::Rows(records.to_vec())).is_err() {
            remote.stop();
        }
    });
    let end = finished.and_then(|mut finished| {
        let facts = serde_json::to_string(&finished.facts).map_err(|e| RunError::usage(e.to_string()))?;
        Ok((facts, finished.outcome.failure.take()))
    });
    let _ = speak.send(News::Over(Box::new(end)));
}
