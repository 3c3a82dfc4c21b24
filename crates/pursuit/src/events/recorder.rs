//! Makes the clips and pictures of events, on a thread of its own.

use crate::sinks::{Moment, OverlayStyle, Painter, Sink};
use crate::{Record, RunError};
use pursuit_imaging::Frame;
use pursuit_media::SourceInfo;
use pursuit_media::output::{ClipRecorder, VideoOptions, write_jpeg};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;

/// Frames waiting to be drawn and encoded before the run has to wait.
const QUEUED_FRAMES: usize = 2;
/// Of pictures of events, 1–100.
const QUALITY: u8 = 85;

/// A frame, and what of it is kept.
struct Shot {
    frame: Arc<Frame>,
    records: Vec<Record>,
    clip: Option<Arc<PathBuf>>,
    snapshot: Option<PathBuf>,
}

/// Takes every frame, holds the last seconds, and makes clips and pictures where the watcher says so.
pub(crate) struct RecorderSink {
    queue: Option<SyncSender<Shot>>,
    thread: Option<JoinHandle<Result<(), RunError>>>,
}

impl RecorderSink {
    /// Of a run's input; clips begin `before_s` before their events.
    ///
    /// # Errors
    /// [`RunError::Output`] when the system gives no thread.
    pub fn new(input: &SourceInfo, style: OverlayStyle, before_s: f64) -> Result<Self, RunError> {
        let painter = Painter::new(input, style);
        let nominal_fps = input.fps.unwrap_or(VideoOptions::default().nominal_fps);
        let recorder = ClipRecorder::new(VideoOptions { nominal_fps, pixel_aspect: painter.pixel_aspect() }, before_s);
        let (queue, shots) = sync_channel(QUEUED_FRAMES);
        let thread = std::thread::Builder::new().name("clips".into()).spawn(move || record(shots, painter, recorder));
        let thread = thread.map_err(RunError::output("clips"))?;
        Ok(Self { queue: Some(queue), thread: Some(thread) })
    }

    /// Waits for the thread and hands out what went wrong there.
    fn join(&mut self) -> Result<(), RunError> {
        self.queue = None;
        match self.thread.take().map(JoinHandle::join) {
            None => Ok(()),
            Some(Ok(result)) => result,
            Some(Err(_)) => {
                Err(RunError::output("clips")(std::io::Error::other("the encoder failed; please report this")))
            }
        }
    }
}

fn record(shots: Receiver<Shot>, mut painter: Painter, mut recorder: ClipRecorder) -> Result<(), RunError> {
    let mut current: Option<Arc<PathBuf>> = None;
    for Shot { frame, records, clip, snapshot } in shots {
        let picture =
            painter.paint(&frame, records).map_err(|e| RunError::output("clips")(std::io::Error::other(e)))?;
        if clip != current {
            match &clip {
                Some(path) => recorder.begin(path)?,
                None => recorder.end()?,
            }
            current = clip;
        }
        recorder.write(picture.view(), frame.time_s())?;
        if let Some(path) = snapshot {
            write_jpeg(&path, picture.view(), QUALITY)?;
        }
    }
    Ok(recorder.end()?)
}

impl Sink for RecorderSink {
    fn write(&mut self, moment: &Moment<'_>) -> Result<(), RunError> {
        let Some(watched) = moment.watched() else { return Ok(()) };
        let shot = Shot {
            frame: moment.frame.clone(),
            records: moment.records.to_vec(),
            clip: watched.clip.clone(),
            snapshot: watched.snapshot.clone(),
        };
        let sent = self.queue.as_ref().is_some_and(|queue| queue.send(shot).is_ok());
        // The thread only stops taking frames when writing has failed.
        if sent { Ok(()) } else { self.join() }
    }

    fn finish(&mut self) -> Result<(), RunError> {
        self.join()
    }
}
