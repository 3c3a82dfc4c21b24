//! What to evaluate: trackers, sequences, a protocol, and where results go.

use crate::{Given, Protocol};
use pursuit_media::OpenOptions;
use pursuit_tracking::Recipe;
use std::path::PathBuf;

/// A tracker that takes part: a recipe under the name it has in the results.
pub struct Entry {
    /// Its name in folders, tables and plots.
    pub name: String,
    /// Makes the tracker.
    pub recipe: Box<dyn Recipe>,
}

impl From<Box<dyn Recipe>> for Entry {
    fn from(recipe: Box<dyn Recipe>) -> Self {
        Self { name: recipe.name().to_owned(), recipe }
    }
}

/// What to evaluate, and how.
pub struct EvalOptions {
    /// Folders to search for sequences, or single sequences.
    pub datasets: Vec<PathBuf>,
    /// The trackers to evaluate.
    pub trackers: Vec<Entry>,
    /// Trajectories made before, to be scored beside them; by one-pass protocols only.
    pub given: Vec<Given>,
    /// The passes to run, and how they are scored.
    pub protocol: Protocol,
    /// Comma-separated patterns of the sequences wanted; all without.
    pub sequences: Option<String>,
    /// A table of attributes of the sequences, beside those that the data sets bring: see [`Dataset::add_attributes`].
    ///
    /// [`Dataset::add_attributes`]: crate::Dataset::add_attributes
    pub attributes: Option<PathBuf>,
    /// Sequences worked on at once, each by one thread. Results do not depend on it; on a busy machine speeds may.
    pub jobs: usize,
    /// Where results are kept: `boxes/`, `results.json`, `tables/`, `curves/`, `report.html`. Protocols may share a folder.
    pub out: PathBuf,
    /// What made the run (a version, a build's hash): results that another build left are run again.
    pub build: String,
    /// Memory that decoded frames may take, in bytes; longer sequences are decoded again for every tracker.
    pub frame_memory_bytes: u64,
    /// Whether `report.html` is written.
    pub report: bool,
    /// Whether the report shows frames of the sequences (which are decoded once more for it).
    pub thumbnails: bool,
    /// Stored results to compare with: a `results.json`, of this program or another.
    pub against: Option<PathBuf>,
    /// How frames are opened.
    pub open: OpenOptions,
}

impl EvalOptions {
    /// The defaults: everything below `datasets`, one pass, one job, 1.5 GB of frames, a report with pictures.
    pub fn new(datasets: Vec<PathBuf>, trackers: Vec<Entry>, out: PathBuf) -> Self {
        Self {
            datasets,
            trackers,
            given: Vec::new(),
            protocol: Protocol::Ope,
            sequences: None,
            attributes: None,
            jobs: 1,
            out,
            build: env!("CARGO_PKG_VERSION").to_owned(),
            frame_memory_bytes: 1_500_000_000,
            report: true,
            thumbnails: true,
            against: None,
            open: OpenOptions::default(),
        }
    }
}
