//! What Python iterates over as the source of a run.
//!
//! The run asks for a frame when it has done with the one before, and whoever waits for estimates answers on its own thread.
//! So a generator is called where its estimates are iterated over, and may use the memory of a frame again.

use crate::errors::{InputError, of_run, usage};
use pursuit::Frame;
use pursuit::media::input::{Frames, StopHandle};
use pursuit::media::{MediaError, Result, Source};
use pyo3::prelude::*;
use pyo3::types::PyIterator;
use std::sync::mpsc::{Sender, channel};

/// What messages call it.
const NAME: &str = "arrays";
/// Frames per second where none are given.
const DEFAULT_FPS: f64 = 30.0;

/// Hands frames, and depth where there is some, to a run that asks for them.
pub struct Iterated {
    frames: Py<PyIterator>,
    depths: Option<Py<PyIterator>>,
    channels: String,
    fps: f64,
    /// The number of the next frame.
    next: u64,
    answers: Sender<Option<Result<Frame>>>,
}

/// A source over `frames`, whose first is taken at once, and what answers when `ask` has asked for another; `ask` is false
/// where nobody is left to answer.
pub fn source(
    frames: &Bound<'_, PyAny>,
    depths: Option<&Bound<'_, PyAny>>,
    channels: &str,
    fps: Option<f64>,
    mut ask: impl FnMut() -> bool + Send + 'static,
) -> PyResult<(Iterated, Box<dyn Source>)> {
    let fps = fps.unwrap_or(DEFAULT_FPS);
    if !(fps.is_finite() && fps > 0.0) {
        return Err(usage(format!("fps is {fps}; give frames per second, above 0")));
    }
    let (answers, heard) = channel();
    let stop = answers.clone();
    let mut iterated = Iterated {
        frames: frames.try_iter()?.unbind(),
        depths: depths.map(|depths| depths.try_iter().map(Bound::unbind)).transpose()?,
        channels: channels.to_owned(),
        fps,
        next: 0,
        answers,
    };
    // Nobody answers yet: where there is no first frame, none is asked for.
    let first = iterated.take(frames.py())?;
    let first = first.ok_or_else(|| InputError::new_err(format!("cannot read {NAME}: it has no frames")))?;
    let others = std::iter::from_fn(move || if ask() { heard.recv().ok().flatten() } else { None });
    let all = Frames::new(NAME, std::iter::once(Ok(first)).chain(others)).map_err(|e| of_run(&e.into()))?;
    let mut all = all.stopped_by(StopHandle::new(move || _ = stop.send(None)));
    let info = all.info_mut();
    (info.fps, info.frame_count) = (Some(fps), frames.len().ok().map(|count| count as u64));
    Ok((iterated, Box::new(all)))
}

impl Iterated {
    /// Answers with the next frame. What Python raises is returned, and ends the run.
    pub fn answer(&mut self, py: Python<'_>) -> PyResult<()> {
        let (answer, raised) = match self.take(py) {
            Ok(frame) => (frame.map(Ok), Ok(())),
            Err(error) => {
                let reason = error.value(py).to_string();
                (Some(Err(MediaError::Broken { name: NAME.to_owned(), frame: self.next, reason })), Err(error))
            }
        };
        // A run that has ended hears nothing.
        let _ = self.answers.send(answer);
        raised
    }

    fn take(&mut self, py: Python<'_>) -> PyResult<Option<Frame>> {
        let Some(array) = self.frames.bind(py).clone().next().transpose()? else { return Ok(None) };
        let depth = match &self.depths {
            Some(depths) => {
                let missing = || InputError::new_err("there are fewer depth images than frames");
                Some(depths.bind(py).clone().next().transpose()?.ok_or_else(missing)?)
            }
            None => None,
        };
        let frame =
            crate::pixels::frame(self.next, self.next as f64 / self.fps, &array, depth.as_ref(), &self.channels)?;
        self.next += 1;
        Ok(Some(frame))
    }
}
