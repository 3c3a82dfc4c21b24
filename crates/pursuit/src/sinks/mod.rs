//! Where the results of a run go. Files are written as the run goes, complete up to the last frame.

mod coco;
mod csv;
mod cvat;
#[cfg(feature = "encode")]
mod depth_inset;
#[cfg(feature = "encode")]
mod drawing;
mod format;
mod jsonl;
mod mcap;
mod moment;
mod mot;
#[cfg(feature = "encode")]
mod overlay;
mod parquet;
mod predictions;
mod text;
mod vot;
mod xlsx;

pub(crate) use csv::can_be_added_to;
pub use csv::{TRAJECTORY_COLUMNS, parse_trajectory, read_trajectory};
#[cfg(feature = "encode")]
pub(crate) use drawing::color_of;
pub use format::Format;
pub(crate) use format::Lines;
#[cfg(any(feature = "mcap", all(test, feature = "publish")))]
pub(crate) use jsonl::object as jsonl_object;
#[cfg(feature = "mcap")]
pub use mcap::McapSink;
pub use moment::Moment;
#[cfg(feature = "encode")]
pub use overlay::OverlaySink;
#[cfg(feature = "encode")]
pub(crate) use overlay::{Painter, TRAIL_S, step};
#[cfg(feature = "parquet")]
pub use parquet::ParquetSink;
#[cfg(feature = "parquet")]
pub(crate) use parquet::write_column as parquet_column;
pub(crate) use text::TextSink;

use crate::{Record, RunError};
use pursuit_media::SourceInfo;
use pursuit_tracking::{Class, Estimate, TrackState};
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::path::{Path, PathBuf};

/// The one list of formats.
const LIST: [Format; 11] = [
    csv::FORMAT,
    csv::SEMICOLON,
    xlsx::FORMAT,
    jsonl::FORMAT,
    mot::FORMAT,
    parquet::FORMAT,
    predictions::FORMAT,
    coco::FORMAT,
    cvat::FORMAT,
    vot::FORMAT,
    mcap::FORMAT,
];

/// How much the overlay video shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum OverlayStyle {
    /// Measured, predicted and estimated boxes, state and score; of more than eight targets the estimates and numbers.
    #[default]
    Full,
    /// The estimated boxes and their trails, and numbers where there are several.
    Minimal,
}

/// Takes every frame with the records made of it.
pub trait Sink: Send {
    /// Takes one frame; when it returns, what it wrote survives a crash of this process (a sink that works behind a queue
    /// may lag by the length of its queue).
    ///
    /// # Errors
    /// [`RunError::Output`] when it cannot be written; what was written before is kept.
    fn write(&mut self, moment: &Moment<'_>) -> Result<(), RunError>;

    /// Nothing more comes: closes files properly.
    ///
    /// # Errors
    /// As [`write`](Self::write).
    fn finish(&mut self) -> Result<(), RunError>;

    /// The files written; none for a sink that is a screen, a socket or a pan-tilt head.
    fn files(&self) -> Vec<PathBuf> {
        Vec::new()
    }
}

/// The sink of the overlay video, where it is wanted and this build can.
///
/// # Errors
/// When the file cannot be written, or the video is asked for by name and this build has no encoder.
pub(crate) fn overlay(
    path: &Path,
    input: &SourceInfo,
    wanted: Option<bool>,
    style: OverlayStyle,
) -> Result<Option<Box<dyn Sink>>, RunError> {
    if wanted == Some(false) {
        return Ok(None);
    }
    #[cfg(feature = "encode")]
    return Ok(Some(Box::new(OverlaySink::create_for(path, input, style)?)));
    #[cfg(not(feature = "encode"))]
    match (path, input, style, wanted, crate::NO_OVERLAY) {
        (.., Some(true), Some(why)) => Err(RunError::usage(why)),
        _ => Ok(None),
    }
}

/// Whether there is to be an overlay video.
///
/// # Errors
/// When it is asked for by name and this build has no encoder.
pub(crate) fn has_overlay(wanted: Option<bool>) -> Result<bool, RunError> {
    match (wanted, crate::NO_OVERLAY) {
        (Some(true), Some(why)) => Err(RunError::usage(why)),
        (wanted, why) => Ok(wanted != Some(false) && why.is_none()),
    }
}

/// A sink that takes all and keeps nothing.
pub(crate) fn nothing() -> Box<dyn Sink> {
    struct Nothing;
    impl Sink for Nothing {
        fn write(&mut self, _: &Moment<'_>) -> Result<(), RunError> {
            Ok(())
        }

        fn finish(&mut self) -> Result<(), RunError> {
            Ok(())
        }
    }
    Box::new(Nothing)
}

/// Creates a file inside a run's folder.
fn create(path: &Path) -> Result<File, RunError> {
    File::create(path).map_err(RunError::output(path))
}

/// A target is annotated where it is believed to be in the picture: not while it is lost.
fn annotated(record: &Record) -> Option<&Estimate> {
    record.estimate.as_ref().filter(|e| e.state != TrackState::Lost)
}

/// What annotations call a target.
fn label(record: &Record) -> &str {
    record.class.as_ref().map_or("target", Class::as_str)
}
