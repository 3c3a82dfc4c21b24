//! What of a batch is done, on disk: finished work is told from work that a crash cut off.

use super::manifest::ClipJob;
use crate::RunError;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

/// The folder with one folder for each clip.
const CLIPS: &str = "clips";
/// The folder with the dataset: one partition for each clip.
const DATASET: &str = "dataset";
/// In a clip's folder, written last: what was done.
const FINISHED: &str = "finished.json";

/// How a clip ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ClipOutcome {
    /// The clip.
    pub clip: String,
    /// What was asked for, so that another wish is run again.
    pub asked: serde_json::Value,
    /// Version of pursuit.
    pub version: String,
    /// Frames looked at.
    pub frames: u64,
    /// Seconds it took.
    pub seconds: f64,
    /// What was wrong with it, where something was; what could be read was tracked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
}

impl ClipOutcome {
    /// Of a clip before it is tracked.
    pub(super) fn new(job: &ClipJob) -> Self {
        let (asked, version) =
            (serde_json::to_value(&job.config).unwrap_or_default(), env!("CARGO_PKG_VERSION").to_owned());
        Self { clip: job.name.clone(), asked, version, frames: 0, seconds: 0.0, error: None }
    }

    /// Of a clip that could not be come to.
    pub fn failed(job: &ClipJob, error: impl Into<String>) -> Self {
        Self { error: Some(error.into()), ..Self::new(job) }
    }
}

/// The folder of a batch.
#[derive(Debug)]
pub(super) struct Ledger {
    out: PathBuf,
}

impl Ledger {
    pub fn new(out: &Path) -> Result<Self, RunError> {
        std::fs::create_dir_all(out.join(CLIPS)).map_err(RunError::output(out))?;
        Ok(Self { out: out.to_path_buf() })
    }

    /// Where the files of a clip go.
    pub fn clip(&self, name: &str) -> PathBuf {
        self.out.join(CLIPS).join(name)
    }

    /// The partition of a clip, and what it is called while it is written.
    #[cfg(feature = "parquet")]
    pub fn partition(&self, name: &str) -> Result<(PathBuf, PathBuf), RunError> {
        let folder = self.out.join(DATASET).join(format!("clip={name}"));
        std::fs::create_dir_all(&folder).map_err(RunError::output(&folder))?;
        // Readers of datasets pass over names that begin with a dot.
        Ok((folder.join("trajectory.parquet"), folder.join(".trajectory.parquet.part")))
    }

    /// What an earlier call did of this clip, if it did this.
    pub fn finished(&self, job: &ClipJob) -> Option<ClipOutcome> {
        let text = std::fs::read(self.clip(&job.name).join(FINISHED)).ok()?;
        let outcome: ClipOutcome = serde_json::from_slice(&text).ok()?;
        let whole = cfg!(not(feature = "parquet"))
            || self.out.join(DATASET).join(format!("clip={}", job.name)).join("trajectory.parquet").is_file();
        let wanted = ClipOutcome::new(job);
        let same = outcome.asked == wanted.asked && outcome.version == wanted.version;
        (whole && same && outcome.error.is_none()).then_some(outcome)
    }

    /// Forgets what an earlier call did of a clip, before it is done again.
    pub fn begin(&self, name: &str) -> Result<(), RunError> {
        let path = self.clip(name).join(FINISHED);
        match std::fs::remove_file(&path) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(RunError::output(path)(e)),
            _ => Ok(()),
        }
    }

    /// Says that a clip is done, once everything of it is on disk.
    pub fn finish(&self, outcome: &ClipOutcome) -> Result<(), RunError> {
        let folder = self.clip(&outcome.clip);
        std::fs::create_dir_all(&folder).map_err(RunError::output(&folder))?;
        write_whole(&folder.join(FINISHED), outcome)
    }

    /// Writes `batch.json`: every clip and how it ended.
    pub fn summarise(&self, summary: &impl Serialize) -> Result<(), RunError> {
        write_whole(&self.out.join("batch.json"), summary)
    }
}

/// Whoever reads the file sees the old one or the new one, also after the power has failed.
fn write_whole(path: &Path, value: &impl Serialize) -> Result<(), RunError> {
    let text = serde_json::to_string_pretty(value).map_err(|e| RunError::output(path)(e.into()))?;
    let temporary = path.with_extension("json.part");
    let written = File::create(&temporary).and_then(|mut file| {
        file.write_all(text.as_bytes())?;
        file.write_all(b"\n")?;
        file.sync_all()
    });
    written.and_then(|()| std::fs::rename(&temporary, path)).map_err(RunError::output(path))
}
