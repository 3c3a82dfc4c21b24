//! What `run.json` holds: what was run, with what, on what, and how it went.

use crate::publish::PublishFacts;
pub use crate::timing::{Timing, TimingSummary};
use crate::{ComparedFacts, RunError, SegmentFacts, View};
pub use pursuit_evaluation::metrics::accuracy::{Accuracy, AccuracyMeter};
use pursuit_geometry::Size;
use pursuit_media::SourceInfo;
use pursuit_media::depth::DepthFacts;
use pursuit_media::wrappers::StreamCounts;
use pursuit_tracking::TrackState;
use serde::Serialize;
use std::path::Path;

/// What `run.json` holds.
#[derive(Debug, Clone, Serialize)]
pub struct RunFile {
    /// Version of pursuit.
    pub version: &'static str,
    /// `running`, `done`, `interrupted`, or `broken` (the input ended early or the output could not be written).
    pub status: &'static str,
    /// What went wrong, where something did.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// The input.
    pub input: InputFacts,
    /// The tracker with every parameter.
    pub recipe: RecipeFacts,
    /// The machine.
    pub host: HostFacts,
    /// The first frame looked at since the run was resumed, where it was; `timing`, `damage`, `dropped_frames` and
    /// `empty_depth_frames` are of the part from there on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resumed_at: Option<u64>,
    /// Frames looked at.
    pub frame_count: u64,
    /// Frames that a live source dropped because they came faster than they could be followed.
    pub dropped_frames: u64,
    /// Frames whose depth image has no data in it, where the input has depth images: they are looked at without depth.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub empty_depth_frames: Option<u64>,
    /// What befell a live input, where it was one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stream: Option<StreamFacts>,
    /// What became of the messages, where results were published.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub publish: Option<PublishFacts>,
    /// The files that the run is cut into, where it is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub segments: Option<SegmentFacts>,
    /// How often something of the input could not be read, and was left out.
    pub damage_count: u64,
    /// What and why, of the first of them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub damage: Vec<String>,
    /// Frames of the targets by state.
    pub states: StateCounts,
    /// How long things took.
    pub timing: TimingFacts,
    /// How well it went, where the input came with the truth.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub accuracy: Option<Accuracy>,
    /// How each tracker did, where several were compared.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub compared: Vec<ComparedFacts>,
}

/// The input of a run.
#[derive(Debug, Clone, Serialize)]
pub struct InputFacts {
    /// As given.
    pub name: String,
    /// What reads it.
    pub decoder: String,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// What of its pictures was looked at, where that was not all as it came.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub view: Option<View>,
    /// Width against height of a pixel, where the input says that they are not square. Boxes are in pixels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pixel_aspect: Option<(u32, u32)>,
    /// Frames per second that the input claims, where it does.
    pub nominal_fps: Option<f64>,
    /// How its depth is read, where it has depth images.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub depth: Option<DepthFacts>,
}

/// What befell a live input.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct StreamFacts {
    /// How often no frame came for longer than allowed.
    pub stalls: u64,
    /// How often the connection broke off.
    pub breaks: u64,
    /// How often it was connected to again, and frames came.
    pub reconnects: u64,
    /// Attempts at that which failed.
    pub failed_attempts: u64,
    /// Frames that came damaged and were left out.
    pub damaged_frames: u64,
    /// The longest time without a frame, seconds.
    pub longest_gap_s: f64,
    /// How much later than the promptest frame, by their own times, frames were taken up, milliseconds.
    pub age_ms: TimingSummary,
}

impl StreamFacts {
    pub(crate) fn new(counts: StreamCounts, age_ms: TimingSummary) -> Self {
        let StreamCounts { stalls, breaks, reconnects, failed_attempts, damaged, longest_gap_s } = counts;
        Self { stalls, breaks, reconnects, failed_attempts, damaged_frames: damaged, longest_gap_s, age_ms }
    }
}

/// The tracker of a run.
#[derive(Debug, Clone, Serialize)]
pub struct RecipeFacts {
    /// Its name.
    pub tracker: String,
    /// What it starts from: `box`, `truth` (the first box of the truth that came with the input), `detector`, or `command` (nothing,
    /// until somebody says what to follow).
    pub start: &'static str,
    /// The frame in which it starts, where it does not wait for a detector.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub start_frame: Option<u64>,
    /// Every parameter with its value.
    pub parameters: toml::Table,
    /// The detector that starts it, where one does.
    pub detector: Option<String>,
    /// Every parameter of that detector with its value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub detector_parameters: Option<toml::Table>,
    /// How the one target found was made sure of (`acquire.KEY`), where one was to be.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub acquire: Option<toml::Table>,
    /// How the targets found are told apart (`many.KEY`), where all are followed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub many: Option<toml::Table>,
    /// The trackers compared with it, in their order.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub compared: Vec<ComparedRecipe>,
    /// The boxes it was started on, left, top, width, height in pixels.
    pub boxes: Vec<[f64; 4]>,
}

/// A tracker that is compared with another.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ComparedRecipe {
    /// Its name.
    pub tracker: String,
    /// Every parameter with its value.
    pub parameters: toml::Table,
}

/// The machine of a run.
#[derive(Debug, Clone, Serialize)]
pub struct HostFacts {
    /// Operating system.
    pub os: &'static str,
    /// Processor architecture.
    pub arch: &'static str,
    /// Processors that can be used.
    pub cpus: usize,
}

impl HostFacts {
    /// Of this machine.
    pub fn here() -> Self {
        let cpus = std::thread::available_parallelism().map_or(1, usize::from);
        Self { os: std::env::consts::OS, arch: std::env::consts::ARCH, cpus }
    }
}

/// How many frames ended in each state, over all targets.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct StateCounts {
    /// Frames in which the target was measured.
    pub tracking: u64,
    /// Frames in which it was in sight, but not for certain.
    pub unsure: u64,
    /// Frames in which it was hidden or coasted.
    pub occluded: u64,
    /// Frames in which it was lost, or not yet found.
    pub lost: u64,
}

impl StateCounts {
    /// Of both.
    pub(crate) const fn with(self, other: Self) -> Self {
        Self {
            tracking: self.tracking + other.tracking,
            unsure: self.unsure + other.unsure,
            occluded: self.occluded + other.occluded,
            lost: self.lost + other.lost,
        }
    }

    /// Counts one more.
    pub const fn add(&mut self, state: TrackState) {
        match state {
            TrackState::Tracking => self.tracking += 1,
            TrackState::Unsure => self.unsure += 1,
            TrackState::Occluded => self.occluded += 1,
            TrackState::Lost => self.lost += 1,
        }
    }
}

/// Durations in milliseconds.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub struct TimingFacts {
    /// One tracker's update, initialisation apart.
    pub update_ms: TimingSummary,
    /// One call of the detector; none where there is no detector.
    pub detect_ms: TimingSummary,
    /// All that is done to look at a frame: the detector's call, where it is asked, and every target's update.
    pub frame_ms: TimingSummary,
    /// Waiting for the next frame: decoding, less what was decoded ahead.
    pub decode_ms: TimingSummary,
    /// From a frame's capture to its results having been handed to all that take them. Of a live input the capture is told by the frame's
    /// own time, beginning with the frame that came soonest after its own: what all frames take to come is not in it. Of a recording
    /// it begins when the frame is taken up.
    pub latency_ms: TimingSummary,
    /// The whole run, seconds.
    pub total_s: f64,
}

impl InputFacts {
    /// Of an input that was opened.
    pub fn of(info: &SourceInfo) -> Self {
        let Size { width, height } = info.input_size();
        Self {
            name: info.name.clone(),
            decoder: info.decoder.clone(),
            width,
            height,
            view: info.view,
            pixel_aspect: info.pixel_aspect,
            nominal_fps: info.fps,
            depth: info.depth.clone(),
        }
    }
}

impl RunFile {
    /// Of a run that begins now.
    pub fn begun(input: InputFacts, recipe: RecipeFacts) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION"),
            status: "running",
            error: None,
            input,
            recipe,
            host: HostFacts::here(),
            resumed_at: None,
            frame_count: 0,
            dropped_frames: 0,
            empty_depth_frames: None,
            stream: None,
            publish: None,
            segments: None,
            damage_count: 0,
            damage: Vec::new(),
            states: StateCounts::default(),
            timing: TimingFacts::default(),
            accuracy: None,
            compared: Vec::new(),
        }
    }

    pub(crate) fn to_json(&self) -> serde_json::Result<String> {
        serde_json::to_string_pretty(self).map(|text| text + "\n")
    }

    /// Writes the file in one step: whoever reads it sees the old one or the new one.
    ///
    /// # Errors
    /// [`RunError::Output`] when it cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), RunError> {
        let text = self.to_json().map_err(|e| RunError::output(path)(e.into()))?;
        let temporary = path.with_extension("json.part");
        std::fs::write(&temporary, text).map_err(RunError::output(path))?;
        std::fs::rename(&temporary, path).map_err(RunError::output(path))
    }
}
