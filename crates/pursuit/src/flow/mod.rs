//! Optical flow of a clip: chosen points followed as long as each can be trusted, or a field of every pixel.
//!
//! ```
//! use pursuit::flow::{Flow, FlowConfig, PointChoice, Wanted};
//! use std::sync::atomic::AtomicBool;
//!
//! # fn main() -> Result<(), pursuit::RunError> {
//! # let folder = std::env::temp_dir().join(format!("flow-doc-{}", std::process::id()));
//! let config = FlowConfig {
//!     to: Some(4),
//!     out: Some(folder.clone()),
//!     ..FlowConfig::new("scene:drift?seed=7", Wanted::points(PointChoice::Corners(40)))
//! };
//! let finished = Flow::prepare(config, &Default::default())?.run(&AtomicBool::new(false), |_| ())?;
//! assert_eq!(finished.frames, 5);
//! assert!(folder.join("points.csv").is_file());
//! # std::fs::remove_dir_all(folder).ok();
//! # Ok(())
//! # }
//! ```

#[cfg(feature = "encode")]
mod drawing;
mod field;
mod folder;
mod points;
#[cfg(test)]
mod tests;

pub use field::{FieldFacts, FieldOptions, Shown};
pub use points::{PointChoice, PointFacts, PointOptions};

use crate::input::{self, OpenedInput};
use crate::{Fetched, Resize, RunConfig, RunError};
use field::FieldRun;
use folder::Folder;
use points::PointRun;
use pursuit_geometry::{Point, Size};
use pursuit_imaging::Frame;
use pursuit_media::{Locator, MediaError, OpenOptions, Source, SourceInfo, View};
use pursuit_tracking::TrackingError;
use pursuit_vision::VisionError;
use serde_json::json;
use std::num::NonZeroU64;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// What to compute, of which input, and where results go.
#[derive(Debug, Clone)]
pub struct FlowConfig {
    /// The input, as [`RunConfig::input`] takes it.
    pub input: Locator,
    /// First frame to look at.
    pub from: Option<u64>,
    /// Last frame to look at.
    pub to: Option<u64>,
    /// Of how many frames one is looked at.
    pub stride: Option<NonZeroU64>,
    /// Frames per second to assume instead of the input's own times.
    pub fps: Option<f64>,
    /// The part of the picture that is looked at, as [`RunConfig::region`] has it; all that is given and written in coordinates stays in
    /// pixels of the whole picture.
    pub region: Option<[f64; 4]>,
    /// The size to which it is brought, as [`RunConfig::resize`] has it.
    pub resize: Option<Resize>,
    /// Folder for the results; without, a new one under `pursuit-out`.
    pub out: Option<PathBuf>,
    /// Whether an overlay video is written.
    pub overlay: bool,
    /// Points or a field.
    pub wanted: Wanted,
}

/// What is computed.
#[derive(Debug, Clone)]
pub enum Wanted {
    /// Points are followed.
    Points(PointOptions),
    /// A field from every frame to the next.
    Field(FieldOptions),
}

impl Wanted {
    /// Points, followed with the defaults.
    pub fn points(choice: PointChoice) -> Self {
        Self::Points(PointOptions { choice, ..PointOptions::default() })
    }
}

impl FlowConfig {
    /// All of `input`, without an overlay, into a new folder.
    pub fn new(input: impl Into<Locator>, wanted: Wanted) -> Self {
        let (from, to, stride, fps, region, resize) = (None, None, None, None, None, None);
        Self { input: input.into(), from, to, stride, fps, region, resize, out: None, overlay: false, wanted }
    }
}

/// A flow that is ready to run.
pub struct Flow {
    input: OpenedInput,
    seen: Seen,
    config: FlowConfig,
    engine: Engine,
}

/// What came of a run.
#[derive(Debug)]
pub struct Finished {
    /// The folder with the results.
    pub out: PathBuf,
    /// Frames that were looked at.
    pub frames: u64,
    /// Frames that could not be had.
    pub damaged: u64,
    /// Of points, what became of them.
    pub points: Option<PointFacts>,
    /// Of fields, how they were.
    pub field: Option<FieldFacts>,
    /// Mean time of a frame, decoding, drawing and writing apart, milliseconds.
    pub mean_ms: f64,
    /// What ended the run early, or the first damaged frame.
    pub failure: Option<RunError>,
}

enum Engine {
    Points(Box<PointRun>),
    Field(Box<FieldRun>),
}

impl Flow {
    /// Checks everything and opens the input; nothing is written yet.
    ///
    /// # Errors
    /// Senseless options, an input that cannot be read, an overlay that this build cannot write.
    pub fn prepare(config: FlowConfig, options: &OpenOptions) -> Result<Self, RunError> {
        crate::sinks::has_overlay(config.overlay.then_some(true))?;
        let engine = match &config.wanted {
            Wanted::Points(options) => Engine::Points(Box::new(PointRun::new(options.clone())?)),
            Wanted::Field(options) => Engine::Field(Box::new(FieldRun::new(options.clone())?)),
        };
        let (from, to, stride, fps) = (config.from, config.to, config.stride, config.fps);
        let (region, resize) = (config.region, config.resize);
        let run = RunConfig { from, to, stride, fps, region, resize, ..RunConfig::default() };
        let input = input::open((&config.input, None), &run, &Fetched::default(), None, options)?;
        let seen = Seen::new(&input.info);
        if let Wanted::Points(PointOptions { choice: PointChoice::Given(points), .. }) = &config.wanted {
            points::check(points, &seen)?;
        }
        Ok(Self { input, seen, config, engine })
    }

    /// What is known of the input.
    pub const fn input(&self) -> &SourceInfo {
        &self.input.info
    }

    /// Runs to the end, or until `stop`; `observe` is told how many frames are done.
    ///
    /// # Errors
    /// Results that cannot be written, no frame, no point to follow. An input that breaks off is part of what is returned.
    pub fn run(self, stop: &AtomicBool, mut observe: impl FnMut(u64)) -> Result<Finished, RunError> {
        let Self { mut input, seen, config, mut engine } = self;
        let mut reader = Reader { source: &mut *input.source, size: None, damaged: 0, failure: None };
        let Some(first) = reader.next() else {
            let none = || RunError::usage(format!("{} has no frame to look at", input.info.name));
            return Err(reader.failure.unwrap_or_else(none));
        };
        let name = config.input.clone();
        let folder = Folder::open(config.out.as_deref(), &name)?;
        let overlay = config.overlay.then(|| folder.overlay(&input.info)).transpose()?;
        match &mut engine {
            Engine::Points(run) => run.begin(&folder, overlay, (&first, &seen))?,
            Engine::Field(run) => run.begin(&folder, overlay, &seen)?,
        }
        let mut frames = 1;
        let mut before = Arc::new(first);
        while !stop.load(Ordering::Relaxed) {
            observe(frames);
            let Some(frame) = reader.next() else { break };
            let frame = Arc::new(frame);
            match &mut engine {
                Engine::Points(run) => run.step([&before, &frame], &seen)?,
                Engine::Field(run) => run.step([&before, &frame], &seen)?,
            }
            before = frame;
            frames += 1;
        }
        let (damaged, failure) = (reader.damaged, reader.failure);
        let (points, field, mean_ms) = match &mut engine {
            Engine::Points(run) => (Some(run.finish()?), None, run.mean_ms()),
            Engine::Field(run) => (None, Some(run.finish()?), run.mean_ms()),
        };
        let out = folder.path().to_path_buf();
        let finished = Finished { out, frames, damaged, points, field, mean_ms, failure };
        folder.facts(&finished.to_json(&input.info))?;
        Ok(finished)
    }
}

impl Finished {
    /// The facts of a run, as `flow.json` has them.
    pub fn to_json(&self, input: &SourceInfo) -> serde_json::Value {
        let Size { width, height } = input.view.map_or(input.size, |view| view.input);
        json!({
            "version": env!("CARGO_PKG_VERSION"),
            "flow": if self.points.is_some() { "points" } else { "field" },
            "input": { "name": input.name, "width": width, "height": height, "fps": input.fps, "view": input.view },
            "frames": self.frames,
            "damaged": self.damaged,
            "points": self.points,
            "field": self.field,
            "mean_ms": self.mean_ms,
            "failure": self.failure.as_ref().map(ToString::to_string),
        })
    }
}

/// What is seen of the input's picture, and how its pixels and those of the frames belong together.
#[derive(Debug, Clone, Copy)]
struct Seen(View);

impl Seen {
    fn new(info: &SourceInfo) -> Self {
        let Size { width, height } = info.size;
        let whole = View { input: info.size, region: [0, 0, width, height], size: [width, height] };
        Self(info.view.unwrap_or(whole))
    }

    /// The part, in pixels of the input.
    fn size(&self) -> Size {
        let [_, _, width, height] = self.0.region;
        Size::new(width, height)
    }

    fn of_input(&self, p: Point) -> Point {
        self.0.point_of_input(p)
    }

    fn in_input(&self, p: Point) -> Point {
        self.0.point_in_input(p)
    }

    /// A motion of the frames in the input's pixels.
    fn motion(&self, [u, v]: [f32; 2]) -> [f64; 2] {
        let [sx, sy] = self.0.scale();
        [f64::from(u) / sx, f64::from(v) / sy]
    }

    /// A length of the frames in the input's pixels: by the mean of both scales where they differ.
    fn length(&self, px: f64) -> f64 {
        let [sx, sy] = self.0.scale();
        px / (sx * sy).sqrt()
    }

    /// Points `step` pixels of the input apart over the part, in the input's pixels: [`grid`].
    fn grid(&self, step: f64) -> (usize, impl Iterator<Item = Point> + use<>) {
        let (count, points) = grid(self.size(), step);
        let [x, y] = self.0.origin();
        (count, points.map(move |p| Point::new(p.x + x, p.y + y)))
    }
}

/// Points `step` pixels apart in the middle of a picture, row by row, as many as there is room for: how many, and they.
fn grid(size: Size, step: f64) -> (usize, impl Iterator<Item = Point> + use<>) {
    let along = |length: usize| {
        let n = (length as f64 / step).floor().max(1.0) as usize;
        (n, (length as f64 - (n - 1) as f64 * step) / 2.0)
    };
    let ((columns, left), (rows, top)) = (along(size.width), along(size.height));
    let at = move |i: usize| Point::new(left + (i % columns) as f64 * step, top + (i / columns) as f64 * step);
    let count = columns.saturating_mul(rows);
    (count, (0..count).map(at))
}

/// Reads frames: damaged ones are counted, what ends the input is kept.
struct Reader<'a> {
    source: &'a mut dyn Source,
    size: Option<Size>,
    damaged: u64,
    failure: Option<RunError>,
}

impl Reader<'_> {
    fn next(&mut self) -> Option<Frame> {
        loop {
            match self.source.next_frame() {
                Ok(frame) => return self.of_one_size(frame?),
                Err(error) => {
                    let goes_on = error.is_damage();
                    self.damaged += u64::from(goes_on);
                    self.keep(error);
                    if !goes_on {
                        return None;
                    }
                }
            }
        }
    }

    fn of_one_size(&mut self, frame: Frame) -> Option<Frame> {
        let (expected, actual) = (*self.size.get_or_insert(frame.size()), frame.size());
        if expected == actual {
            return Some(frame);
        }
        self.failure.get_or_insert(TrackingError::FrameSize { index: frame.index(), expected, actual }.into());
        None
    }

    fn keep(&mut self, error: MediaError) {
        self.failure.get_or_insert(error.into());
    }
}

/// What vision refuses is wrong usage: its parameters, or a picture too small for them.
fn refused(error: VisionError) -> RunError {
    RunError::usage(error.to_string())
}
