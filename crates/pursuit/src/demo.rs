//! `pursuit demo`: a table-tennis rally made on the spot, tracked, drawn and measured against its own truth.

use crate::session::{Progress, Remote};
use crate::{Fetched, Finished, Run, RunConfig, RunError};
use pursuit_media::OpenOptions;
use pursuit_parameters::{merge, nested};
use std::path::Path;

/// The demo, prepared.
pub struct Demo(Run);

impl Demo {
    /// Prepares the rally of `seed`, with results in `out` and `settings` as in [`RunConfig::parameters`].
    ///
    /// # Errors
    /// When the folder cannot be made, or a parameter makes no sense.
    pub fn prepare(seed: u64, out: &Path, settings: &toml::Table) -> Result<Self, RunError> {
        let mut parameters = toml::Table::from_iter([("color".to_owned(), "yellow".into())]);
        merge(&mut parameters, nested(settings));
        let config = RunConfig {
            input: Some(format!("scene:table-tennis?seed={seed}").into()),
            detect: Some("ball".into()),
            out: Some(out.to_path_buf()),
            plots: Some(true),
            parameters,
            ..RunConfig::default()
        };
        Ok(Self(Run::prepare_with(config, None, Fetched::default(), &OpenOptions::default())?))
    }

    /// How many frames there will be.
    pub fn frame_count(&self) -> Option<u64> {
        self.0.frame_count()
    }

    /// As [`Run::remote`].
    pub fn remote(&self) -> Remote {
        self.0.remote()
    }

    /// Runs it.
    ///
    /// # Errors
    /// As [`Run::run`].
    pub fn run(self, observe: impl FnMut(Progress<'_>)) -> Result<Finished, RunError> {
        self.0.run(observe)
    }
}
