use super::{LineFile, Sink};
use crate::{Record, RunError};
use pursuit_imaging::Frame;
use pursuit_tracking::TrackState;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Writes `trajectory.txt` as MOTChallenge wants it: `frame,id,left,top,width,height,conf,-1,-1,-1`, frames, boxes' corners
/// from 1; only targets that are being measured have a line.
pub struct MotSink {
    file: LineFile,
}

impl MotSink {
    /// Creates the file.
    ///
    /// # Errors
    /// [`RunError::Output`] when it cannot be written.
    pub fn create(path: &Path) -> Result<Self, RunError> {
        Ok(Self { file: LineFile::create(path)? })
    }

    /// Goes on with a file that is there.
    ///
    /// # Errors
    /// [`RunError::Output`] when it cannot be written.
    pub(crate) fn append(path: &Path) -> Result<Self, RunError> {
        Ok(Self { file: LineFile::append(path)? })
    }
}

/// What `trajectory.txt` holds of these records, for whoever sends it instead of keeping it.
pub fn mot_lines<'a>(records: impl IntoIterator<Item = &'a Record>) -> Vec<u8> {
    let mut lines = Vec::new();
    for record in records {
        let Some(e) = record.estimate.as_ref().filter(|e| e.state == TrackState::Tracking) else { continue };
        let (left, top, width, height) = e.bbox.ltwh();
        let (frame, id, left, top) = (record.frame + 1, record.target, left + 1.0, top + 1.0);
        // Writing to memory cannot fail.
        let _ = writeln!(lines, "{frame},{id},{left:.3},{top:.3},{width:.3},{height:.3},{:.4},-1,-1,-1", e.score);
    }
    lines
}

impl Sink for MotSink {
    fn write(&mut self, _: &Arc<Frame>, records: &[Record]) -> Result<(), RunError> {
        self.file.pending.extend_from_slice(&mot_lines(records));
        self.file.flush()
    }

    fn finish(&mut self) -> Result<(), RunError> {
        self.file.flush()
    }

    fn files(&self) -> Vec<PathBuf> {
        vec![self.file.path.clone()]
    }
}
