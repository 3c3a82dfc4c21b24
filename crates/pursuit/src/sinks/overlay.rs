use super::drawing::draw;
use super::{Moment, OverlayStyle, Sink};
use crate::{Record, RunError};
use pursuit_geometry::{BBox, Mask, Point, Size};
use pursuit_imaging::{Frame, Image, ImagingError, Rgb8};
use pursuit_media::output::{Mp4Writer, VideoOptions, VideoWriter};
use pursuit_media::{SourceInfo, View};
use pursuit_tracking::{Estimate, TargetId, TrackState};
use std::collections::{BTreeMap, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::JoinHandle;

/// Frames waiting to be drawn and encoded before the run has to wait.
const QUEUED_FRAMES: usize = 2;

/// Larger pictures are halved, thirded …, so that drawing and encoding keep up with them.
const MOST_PIXELS: usize = 2560 * 1440;

/// How much of a target's past is drawn, in seconds.
pub(crate) const TRAIL_S: f64 = 1.5;

/// Writes the overlay video on a thread of its own: measured box and centre green, predicted box red, estimate white (amber
/// while it is coasted), state and score in words, and a trail; of several targets each in a colour of its own; of frames
/// with depth that as well, small, in false colours.
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
    pub fn create(path: &Path, nominal_fps: Option<f64>, style: OverlayStyle) -> Result<Self, RunError> {
        Self::write_to(path, nominal_fps, Painter { style, view: None, pixel_aspect: None, trails: Trails::default() })
    }

    /// The same, of a run's input: at its rate, with pixels of the shape that those of its frames have. Of an input that is
    /// seen in part the part is shown.
    ///
    /// # Errors
    /// As [`create`](Self::create).
    pub fn create_for(path: &Path, input: &SourceInfo, style: OverlayStyle) -> Result<Self, RunError> {
        Self::write_to(path, input.fps, Painter::new(input, style))
    }

    fn write_to(path: &Path, nominal_fps: Option<f64>, mut painter: Painter) -> Result<Self, RunError> {
        let nominal_fps = nominal_fps.unwrap_or(VideoOptions::default().nominal_fps);
        let options = VideoOptions { nominal_fps, pixel_aspect: painter.pixel_aspect };
        let mut video = Mp4Writer::create(path, options)?;
        let (queue, frames) = sync_channel::<(Arc<Frame>, Vec<Record>)>(QUEUED_FRAMES);
        let own_path = path.to_path_buf();
        let encode = move || {
            for (frame, records) in frames {
                let picture = painter.paint(&frame, records);
                let picture = picture.map_err(|e| RunError::output(&own_path)(std::io::Error::other(e)))?;
                video.write(picture.view(), frame.time_s())?;
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
    fn write(&mut self, moment: &Moment<'_>) -> Result<(), RunError> {
        let sent = self.queue.as_ref().is_some_and(|q| q.send((moment.frame.clone(), moment.records.to_vec())).is_ok());
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

/// Draws what is known into the pictures of a run, one after the other.
pub(crate) struct Painter {
    style: OverlayStyle,
    view: Option<View>,
    pixel_aspect: Option<(u32, u32)>,
    trails: Trails,
}

impl Painter {
    /// Of a run's input; of one that is seen in part the part is shown.
    pub fn new(input: &SourceInfo, style: OverlayStyle) -> Self {
        let aspect = input.pixel_aspect.unwrap_or((1, 1));
        let shown = input.view.map_or(aspect, |view| view.pixel_aspect(aspect));
        let pixel_aspect = Some(shown).filter(|(width, height)| width != height);
        Self { style, view: input.view, pixel_aspect, trails: Trails::default() }
    }

    /// Width against height of its pixels, where they are not square.
    pub const fn pixel_aspect(&self) -> Option<(u32, u32)> {
        self.pixel_aspect
    }

    /// The picture with what is known of it.
    ///
    /// # Errors
    /// A picture that cannot be made.
    pub fn paint(&mut self, frame: &Frame, mut records: Vec<Record>) -> Result<Image<Rgb8>, ImagingError> {
        let step = step(frame.size());
        records.iter_mut().filter_map(|r| r.estimate.as_mut()).for_each(|e| place(e, self.view, step as f64));
        self.trails.extend(frame.time_s(), &records);
        draw(frame, step, &records, &self.trails, self.style)
    }
}

/// How many pixels each way one of the video shows: pictures up to [`MOST_PIXELS`] are shown as they are.
pub(crate) fn step(size: Size) -> usize {
    (1..).find(|step| (size.width / step) * (size.height / step) <= MOST_PIXELS).unwrap_or(1)
}

/// Boxes and masks of the input in pixels of the video.
fn place(estimate: &mut Estimate, view: Option<View>, step: f64) {
    if let Some(mask) = estimate.mask.as_ref().filter(|_| view.is_some() || step > 1.0) {
        let ([sx, sy], [x, y]) = view.map_or(([1.0; 2], [0.0; 2]), |view| (view.scale(), view.origin()));
        let scale = [sx / step, sy / step];
        // Drawing clips it to the picture.
        let size = Size::new(Mask::MOST_SIDE, Mask::MOST_SIDE);
        estimate.mask = Some(Arc::new(mask.mapped(scale, [-x * scale[0], -y * scale[1]], size)));
    }
    let boxes = std::iter::once(&mut estimate.bbox).chain(&mut estimate.prediction).chain(&mut estimate.measurement);
    for bbox in boxes {
        let b = view.map_or(*bbox, |view| view.of_input(*bbox));
        *bbox = BBox::from_ltwh(b.left() / step, b.top() / step, b.width() / step, b.height() / step);
    }
}

/// Where each target has been lately.
#[derive(Default)]
pub(super) struct Trails(BTreeMap<TargetId, VecDeque<(f64, Option<Point>)>>);

impl Trails {
    fn extend(&mut self, time_s: f64, records: &[Record]) {
        self.0.retain(|target, _| records.iter().any(|r| r.target == *target));
        for record in records {
            let trail = self.0.entry(record.target).or_default();
            let seen = record.estimate.as_ref().filter(|e| e.state != TrackState::Lost);
            trail.push_back((time_s, seen.map(|e| e.bbox.center())));
            while trail.front().is_some_and(|(t, _)| time_s - t > TRAIL_S || trail.len() > 500) {
                trail.pop_front();
            }
        }
    }

    pub fn of(&self, target: TargetId) -> Vec<Option<Point>> {
        self.0.get(&target).into_iter().flatten().map(|(_, p)| *p).collect()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    #[test]
    fn large_pictures_are_shown_smaller_with_their_boxes() {
        let steps =
            [(640, 480), (2560, 1440), (3840, 2160), (2160, 3840), (7680, 4320)].map(|(w, h)| step(Size::new(w, h)));
        assert_eq!(steps, [1, 1, 2, 2, 3]);
        let bbox = BBox::from_ltwh(300.0, 60.0, 30.0, 90.0);
        let mut estimate = Estimate { prediction: Some(bbox), ..Estimate::started(0.0, bbox, 1.0) };
        place(&mut estimate, None, 3.0);
        let wanted = BBox::from_ltwh(100.0, 20.0, 10.0, 30.0);
        assert_eq!((estimate.bbox, estimate.prediction, estimate.measurement), (wanted, Some(wanted), Some(wanted)));
        estimate.mask = Some(Arc::new(Mask::from_bbox(&estimate.bbox, Size::new(640, 480))));
        // The right half of the input, at half its size.
        let view = View { input: Size::new(80, 40), region: [40, 0, 40, 40], size: [20, 20] };
        place(&mut estimate, Some(view), 2.0);
        assert_eq!(estimate.bbox, BBox::from_ltwh(15.0, 5.0, 2.5, 7.5));
        let mask = estimate.mask.unwrap();
        // Pixels whose centres lie in the box.
        assert_eq!(mask.bounds(), Some(BBox::from_ltrb(15.0, 5.0, 17.0, 12.0)));
    }
}
