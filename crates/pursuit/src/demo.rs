//! `pursuit demo`: a table-tennis rally made on the spot, tracked, drawn and measured against its own truth.

use crate::track::Preference;
use crate::{Finished, Progress, Run, RunConfig, RunError};
use pursuit_media::OpenOptions;
use pursuit_media::input::StopHandle;
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// The demo, prepared.
pub struct Demo(Run);

impl Demo {
    /// Prepares the rally of `seed`, with results in `out`.
    ///
    /// # Errors
    /// When the folder cannot be made.
    pub fn prepare(seed: u64, out: &Path) -> Result<Self, RunError> {
        let config = RunConfig {
            input: Some(format!("scene:table-tennis?seed={seed}")),
            detect: Some("ball".into()),
            out: Some(out.to_path_buf()),
            plots: Some(true),
            seed: Some(seed),
            parameters: toml::Table::from_iter([("color".to_owned(), "yellow".into())]),
            ..RunConfig::default()
        };
        Ok(Self(Run::prepare_with(config, &OpenOptions::default(), Preference::Detector)?))
    }

    /// How many frames there will be.
    pub fn frame_count(&self) -> Option<u64> {
        self.0.frame_count()
    }

    /// As [`Run::stop_handle`].
    pub fn stop_handle(&self) -> Option<StopHandle> {
        self.0.stop_handle()
    }

    /// Runs it.
    ///
    /// # Errors
    /// As [`Run::run`].
    pub fn run(self, stop: &AtomicBool, observe: impl FnMut(Progress<'_>)) -> Result<Finished, RunError> {
        self.0.run(stop, observe)
    }
}
