use super::{LineFile, Sink};
use crate::{Record, RunError};
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_tracking::{Class, Doubt};
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Writes `trajectory.jsonl`: one JSON object a line, with the columns of the CSV grouped, the covariance and the
/// tracker's own diagnostics.
pub struct JsonlSink {
    file: LineFile,
    /// None for standard output.
    path: Option<PathBuf>,
}

impl JsonlSink {
    /// Creates the file.
    ///
    /// # Errors
    /// [`RunError::Output`] when it cannot be written.
    pub fn create(path: &Path) -> Result<Self, RunError> {
        Ok(Self { file: LineFile::create(path)?, path: Some(path.to_path_buf()) })
    }

    /// Goes on with a file that is there.
    ///
    /// # Errors
    /// [`RunError::Output`] when it cannot be written.
    pub(crate) fn append(path: &Path) -> Result<Self, RunError> {
        Ok(Self { file: LineFile::append(path)?, path: Some(path.to_path_buf()) })
    }

    /// Writes to standard output instead.
    pub fn standard_output() -> Self {
        Self { file: LineFile::new(Path::new("standard output"), Box::new(std::io::stdout())), path: None }
    }
}

impl Sink for JsonlSink {
    fn write(&mut self, _: &Arc<Frame>, records: &[Record]) -> Result<(), RunError> {
        for record in records {
            self.file.pending.extend(object(record).to_string().into_bytes());
            self.file.pending.push(b'\n');
        }
        self.file.flush()
    }

    fn finish(&mut self) -> Result<(), RunError> {
        self.file.flush()
    }

    fn files(&self) -> Vec<PathBuf> {
        self.path.iter().cloned().collect()
    }
}

/// The record as a JSON object; what is not there is `null`.
pub(crate) fn object(record: &Record) -> Value {
    let estimate = record.estimate.as_ref();
    let diagnostics: Map<String, Value> =
        estimate.into_iter().flat_map(|e| e.diagnostics.iter()).map(|(k, v)| (k.to_owned(), json!(v))).collect();
    json!({
        "frame": record.frame,
        "time_s": record.time_s,
        "target": record.target.0,
        "class": record.class.as_ref().map(Class::as_str),
        "state": estimate.map_or("lost", |e| e.state.as_str()),
        "doubt": estimate.and_then(|e| e.doubt).map(Doubt::as_str),
        "box": estimate.map(|e| ltwh(e.bbox)),
        "score": estimate.map(|e| e.score),
        "prediction": estimate.and_then(|e| e.prediction).map(ltwh),
        "measurement": estimate.and_then(|e| e.measurement).map(ltwh),
        "covariance": estimate.and_then(|e| e.covariance).map(|c| c.row_iter().map(|r| r.iter().copied().collect()).collect::<Vec<Vec<f64>>>()),
        "next": estimate.and_then(|e| e.next).map(|next| json!({
            "in_s": next.in_s,
            "center": next.center.map(|at| [at.x, at.y]),
        })),
        "diagnostics": diagnostics,
        "update_ms": record.update_ms,
    })
}

fn ltwh(b: BBox) -> [f64; 4] {
    [b.left(), b.top(), b.width(), b.height()]
}
