//! One sequence.

use super::detector::{are_probabilities, detection};
use super::inputs::{Layout, Work};
use super::{Associate, Associated};
use crate::sinks::{Format, TextSink};
use crate::{Record, RunError};
use pursuit_evaluation::boxes::{Boxes, read_boxes};
use pursuit_geometry::Size;
use pursuit_inference::onnx::Device;
use pursuit_media::Source;
use pursuit_trackers::embedding::embedder;
use pursuit_tracking::many::{Associating, Looked, ManyParams, OfflineParams, Placed, offline};
use pursuit_tracking::{Detection, Estimate};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Frames a second where nobody says how many there are.
const USUAL_FPS: f64 = 25.0;

/// A sequence, and all that is needed to follow what is in it.
pub(super) struct Track<'a> {
    pub options: &'a Associate,
    pub params: &'a ManyParams,
    pub work: &'a Work,
    pub layout: Layout,
    pub out: &'a Path,
    pub stop: &'a AtomicBool,
}

impl Track<'_> {
    pub fn run(&self) -> Result<Associated, RunError> {
        let work = self.work;
        let video = self.options.video.as_ref();
        let mut video = video.map(|v| crate::follow::open_with(v.clone(), &self.options.open)).transpose()?;
        let size = work.size.or_else(|| video.as_ref().map(|v| v.info().size));
        let boxes = read_boxes(&work.detections, self.options.format, size)?.in_pixels();
        are_probabilities(&work.detections, &boxes)?;
        let mut files = Files::create(self, size)?;
        let embedder = embedder(&self.params.embedding, self.options.device.unwrap_or(Device::Cpu))?;
        let mut targets = Associating::fed(self.params.clone())?.with_embedder(embedder);
        let mut known = Known::default();
        match &mut video {
            None if self.options.offline => self.offline(size, &boxes, &mut files, &mut known)?,
            Some(video) => self.along(&mut **video, &boxes, &mut targets, &mut files, &mut known)?,
            None => self.alone(size, &boxes, &mut targets, &mut files, &mut known)?,
        }
        files.finish()?;
        Ok(Associated {
            sequence: work.title(self.layout),
            frames: known.frames,
            seconds: known.took.as_secs_f64(),
            targets: known.targets,
            assumed_fps: (work.fps.is_none() && video.is_none()).then_some(USUAL_FPS),
            file: work.file(self.layout, self.out),
        })
    }

    /// By the boxes alone.
    fn alone(
        &self,
        size: Option<Size>,
        boxes: &Boxes,
        targets: &mut Associating,
        files: &mut Files,
        known: &mut Known,
    ) -> Result<(), RunError> {
        let fps = self.work.fps.unwrap_or(USUAL_FPS);
        let frames = self.work.frames.unwrap_or(0).max(boxes.frames());
        let mut detections: Vec<Detection> = Vec::new();
        for frame in 0..frames {
            if self.stop.load(Ordering::Relaxed) {
                break;
            }
            detections.clear();
            detections.extend(boxes.of(frame).iter().map(detection));
            let time_s = frame as f64 / fps;
            let begun = Instant::now();
            let tracks = targets.update(time_s, size, &detections)?;
            known.took += begun.elapsed();
            known.tell(frame, time_s, tracks, files)?;
        }
        Ok(())
    }

    /// The whole clip at once.
    fn offline(&self, size: Option<Size>, boxes: &Boxes, files: &mut Files, known: &mut Known) -> Result<(), RunError> {
        let fps = self.work.fps.unwrap_or(USUAL_FPS);
        let frames = self.work.frames.unwrap_or(0).max(boxes.frames());
        let looked = |frame: u64| Looked {
            time_s: frame as f64 / fps,
            detections: boxes.of(frame).iter().map(detection).collect(),
        };
        let looked: Vec<Looked> = (0..frames).map(looked).collect();
        let begun = Instant::now();
        let placed = offline(self.params.clone(), &OfflineParams::default(), size, &looked)?;
        known.took += begun.elapsed();
        for ((frame, looked), placed) in (0..).zip(&looked).zip(placed) {
            known.start(placed.into_iter().map(|p| record(p, frame, looked.time_s)));
            known.write(frame, files)?;
        }
        Ok(())
    }

    /// Beside the video, frame by frame.
    fn along(
        &self,
        video: &mut dyn Source,
        boxes: &Boxes,
        targets: &mut Associating,
        files: &mut Files,
        known: &mut Known,
    ) -> Result<(), RunError> {
        let mut detections: Vec<Detection> = Vec::new();
        while let Some(frame) = video.next_frame()? {
            if self.stop.load(Ordering::Relaxed) {
                break;
            }
            let index = frame.index();
            let frame = match self.work.fps {
                Some(fps) => frame.retimed(index, index as f64 / fps),
                None => frame,
            };
            detections.clear();
            detections.extend(boxes.of(index).iter().map(detection));
            let begun = Instant::now();
            let tracks = targets.update_in(&frame, &detections)?;
            known.took += begun.elapsed();
            known.tell(index, frame.time_s(), tracks, files)?;
        }
        Ok(())
    }
}

/// A target in a frame of a clip that was looked at at once; a box between two measured ones has no measurement.
fn record(placed: Placed, frame: u64, time_s: f64) -> Record {
    let Placed { id, bbox, score, class, detection } = placed;
    let started = Estimate::started(time_s, bbox, score);
    let estimate = Some(Estimate { measurement: detection.map(|_| bbox), ..started });
    Record { frame, time_s, target: id, class, estimate, update_ms: None }
}

/// What is known so far.
#[derive(Default)]
struct Known {
    frames: u64,
    targets: u64,
    took: Duration,
    /// Keeps its memory from frame to frame.
    records: Vec<Record>,
}

impl Known {
    fn tell(
        &mut self,
        frame: u64,
        time_s: f64,
        tracks: &[pursuit_tracking::many::Track],
        files: &mut Files,
    ) -> Result<(), RunError> {
        self.start(tracks.iter().map(|track| Record {
            frame,
            time_s,
            target: track.id,
            class: track.class.clone(),
            estimate: track.estimate.clone(),
            update_ms: Some(track.elapsed.wall_ms),
        }));
        self.write(frame, files)
    }

    /// What is known of the next frame.
    fn start(&mut self, records: impl Iterator<Item = Record>) {
        self.frames += 1;
        self.records.clear();
        self.records.extend(records);
    }

    fn write(&mut self, frame: u64, files: &mut Files) -> Result<(), RunError> {
        self.targets = self.records.iter().map(|r| r.target.0).fold(self.targets, u64::max);
        files.0.iter_mut().try_for_each(|file| file.add(frame, &self.records))
    }
}

/// The files that are written.
struct Files(Vec<TextSink>);

impl Files {
    fn create(track: &Track<'_>, size: Option<Size>) -> Result<Self, RunError> {
        let size = size.unwrap_or(Size::new(0, 0));
        let further = track.options.formats.iter().map(|format| {
            let extension = Path::new(format.file_name()).extension().unwrap_or_default().to_string_lossy();
            let name = format!("{}.{extension}", track.work.title(track.layout));
            (*format, track.out.join(format.name()).join(name))
        });
        let all: Vec<(Format, PathBuf)> =
            std::iter::once((Format::MOT, track.work.file(track.layout, track.out))).chain(further).collect();
        let create = |(format, path): (Format, PathBuf)| {
            if let Some(folder) = path.parent() {
                std::fs::create_dir_all(folder).map_err(RunError::output(folder))?;
            }
            format.create_text(&path, size)
        };
        Ok(Self(all.into_iter().map(create).collect::<Result<_, RunError>>()?))
    }

    fn finish(&mut self) -> Result<(), RunError> {
        self.0.iter_mut().try_for_each(TextSink::end)
    }
}
