use super::{Sink, depth_inset};
use crate::{Record, RunError};
use pursuit_geometry::{BBox, Point};
use pursuit_imaging::{Frame, Rgb8};
use pursuit_media::output::{Canvas, Mp4Writer, Stroke, VideoOptions, VideoWriter};
use pursuit_tracking::{Estimate, TargetId, TrackState};
use std::collections::{BTreeMap, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::JoinHandle;

/// Frames waiting to be drawn and encoded before the run has to wait.
const QUEUED_FRAMES: usize = 4;

/// How much of a target's past is drawn, in seconds.
const TRAIL_S: f64 = 1.5;

const MEASURED: Rgb8 = [40, 220, 60];
const PREDICTED: Rgb8 = [240, 50, 50];
const ESTIMATE: Rgb8 = [255, 255, 255];
const COASTING: Rgb8 = [255, 190, 40];

/// Writes the overlay video on a thread of its own: measured box and centre green, predicted box red, estimate white (amber
/// while it is coasted), state and score in words, and a trail; of frames with depth that as well, small, in false colours.
pub struct OverlaySink {
    path: PathBuf,
    queue: Option<SyncSender<(Arc<Frame>, Vec<Record>)>>,
    thread: Option<JoinHandle<Result<(), RunError>>>,
}

impl OverlaySink {
    /// Creates the file.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn create(path: &Path, nominal_fps: Option<f64>) -> Result<Self, RunError> {
        let options = nominal_fps.map_or_else(VideoOptions::default, |nominal_fps| VideoOptions { nominal_fps });
        let mut video = Mp4Writer::create(path, options)?;
        let (queue, frames) = sync_channel::<(Arc<Frame>, Vec<Record>)>(QUEUED_FRAMES);
        let encode = move || {
            let mut trails = Trails::default();
            for (frame, records) in frames {
                trails.extend(frame.time_s(), &records);
                video.write(draw(&frame, &records, &trails).view(), frame.time_s())?;
            }
            Ok(video.finish()?)
        };
        let thread =
            std::thread::Builder::new().name("overlay".into()).spawn(encode).map_err(RunError::output(path))?;
        Ok(Self { path: path.to_path_buf(), queue: Some(queue), thread: Some(thread) })
    }

    /// Waits for the thread and hands out what went wrong there.
    fn join(&mut self) -> Result<(), RunError> {
        self.queue = None;
        match self.thread.take().map(JoinHandle::join) {
            None => Ok(()),
            Some(Ok(result)) => result,
            Some(Err(_)) => {
                Err(RunError::output(&self.path)(std::io::Error::other("the encoder failed; please report this")))
            }
        }
    }
}

impl Sink for OverlaySink {
    fn write(&mut self, frame: &Arc<Frame>, records: &[Record]) -> Result<(), RunError> {
        let sent = self.queue.as_ref().is_some_and(|q| q.send((frame.clone(), records.to_vec())).is_ok());
        // The thread only stops taking frames when writing has failed.
        if sent { Ok(()) } else { self.join() }
    }

    fn finish(&mut self) -> Result<(), RunError> {
        self.join()
    }

    fn files(&self) -> Vec<PathBuf> {
        vec![self.path.clone()]
    }
}

/// Where each target has been lately.
#[derive(Default)]
struct Trails(BTreeMap<TargetId, VecDeque<(f64, Option<Point>)>>);

impl Trails {
    fn extend(&mut self, time_s: f64, records: &[Record]) {
        for record in records {
            let trail = self.0.entry(record.target).or_default();
            let seen = record.estimate.as_ref().filter(|e| e.state != TrackState::Lost);
            trail.push_back((time_s, seen.map(|e| e.bbox.center())));
            while trail.front().is_some_and(|(t, _)| time_s - t > TRAIL_S || trail.len() > 500) {
                trail.pop_front();
            }
        }
    }

    fn of(&self, target: TargetId) -> Vec<Option<Point>> {
        self.0.get(&target).into_iter().flatten().map(|(_, p)| *p).collect()
    }
}

fn draw(frame: &Frame, records: &[Record], trails: &Trails) -> pursuit_imaging::Image<Rgb8> {
    let mut picture = frame.color().to_image();
    if let Some(depth) = frame.depth_mm() {
        depth_inset::draw(&mut picture, depth, records.iter().filter_map(|r| r.estimate.as_ref().map(|e| e.bbox)));
    }
    let mut canvas = Canvas::new(picture);
    let many = records.len() > 1;
    for record in records {
        match &record.estimate {
            Some(estimate) => draw_target(&mut canvas, estimate, record.target, many, &trails.of(record.target)),
            None => canvas.label(&BBox::from_ltwh(0.0, 0.0, 1.0, 1.0), "looking for a target", COASTING),
        }
    }
    canvas.into_image()
}

fn draw_target(canvas: &mut Canvas, estimate: &Estimate, target: TargetId, many: bool, trail: &[Option<Point>]) {
    let width = 2.0 * canvas.scale();
    canvas.trail(trail, &Stroke::new(ESTIMATE, width).with_opacity(0.6));
    if let Some(predicted) = &estimate.prediction {
        canvas.rectangle(predicted, &Stroke::new(PREDICTED, width));
    }
    if let Some(measured) = &estimate.measurement {
        canvas.rectangle(measured, &Stroke::new(MEASURED, width));
        canvas.dot(measured.center(), 1.5 * width, MEASURED, 1.0);
    }
    let color = if estimate.state == TrackState::Tracking { ESTIMATE } else { COASTING };
    let stroke = Stroke::new(color, 0.75 * width);
    canvas.rectangle(
        &estimate.bbox,
        &if estimate.state == TrackState::Lost { stroke.dashed(3.0 * width, 2.0 * width) } else { stroke },
    );
    let name = if many { format!("{target} ") } else { String::new() };
    canvas.label(&estimate.bbox, &format!("{name}{} {:.2}", estimate.state, estimate.score), color);
}
