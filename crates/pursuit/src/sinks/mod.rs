//! Where the results of a run go. Files are written as the run goes, complete up to the last frame.

mod csv;
#[cfg(feature = "encode")]
mod depth_inset;
#[cfg(feature = "encode")]
mod drawing;
mod format;
mod jsonl;
mod mot;
#[cfg(feature = "encode")]
mod overlay;
#[cfg(feature = "parquet")]
mod parquet;
mod predictions;

pub use csv::{CsvSink, TRAJECTORY_COLUMNS, read_trajectory, trajectory_csv};
pub use format::Format;
pub use jsonl::JsonlSink;
#[cfg(all(test, feature = "publish"))]
pub(crate) use jsonl::object as jsonl_object;
pub use mot::{MotSink, mot_lines};
#[cfg(feature = "encode")]
pub use overlay::OverlaySink;
#[cfg(feature = "parquet")]
pub use parquet::ParquetSink;
pub use predictions::PredictionsSink;

use crate::{Record, RunError};
use pursuit_imaging::Frame;
use pursuit_media::output::VideoOptions;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

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
    fn write(&mut self, frame: &Arc<Frame>, records: &[Record]) -> Result<(), RunError>;

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
    options: VideoOptions,
    wanted: Option<bool>,
    style: OverlayStyle,
) -> Result<Option<Box<dyn Sink>>, RunError> {
    if wanted == Some(false) {
        return Ok(None);
    }
    #[cfg(feature = "encode")]
    return Ok(Some(Box::new(OverlaySink::create_with(path, options, style)?)));
    #[cfg(not(feature = "encode"))]
    match (path, options, style, wanted, crate::NO_OVERLAY) {
        (.., Some(true), Some(why)) => Err(RunError::usage(why)),
        _ => Ok(None),
    }
}

/// Creates a file inside a run's folder.
fn create(path: &Path) -> Result<File, RunError> {
    File::create(path).map_err(RunError::output(path))
}

/// Text lines that go to disk frame by frame: one write call for all lines of a frame, so that a crash leaves whole lines.
struct LineFile {
    path: PathBuf,
    out: Box<dyn Write + Send>,
    pending: Vec<u8>,
}

impl LineFile {
    fn create(path: &Path) -> Result<Self, RunError> {
        Ok(Self::new(path, Box::new(create(path)?)))
    }

    /// Goes on with a file that is there.
    fn append(path: &Path) -> Result<Self, RunError> {
        let file = File::options().append(true).open(path).map_err(RunError::output(path))?;
        Ok(Self::new(path, Box::new(file)))
    }

    fn new(path: &Path, out: Box<dyn Write + Send>) -> Self {
        Self { path: path.to_path_buf(), out, pending: Vec::new() }
    }

    fn flush(&mut self) -> Result<(), RunError> {
        let written = self.out.write_all(&self.pending).and_then(|()| self.out.flush());
        self.pending.clear();
        written.map_err(RunError::output(&self.path))
    }
}
