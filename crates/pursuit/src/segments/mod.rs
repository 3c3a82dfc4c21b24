//! `--segment` and `--keep`: what grows while a run goes on is cut into files that each open by themselves, and those that are
//! old enough are removed.
//!
//! Names carry the time of their first frame (UTC), so that they sort by time. That time is the run's beginning and what has
//! passed since by the frames' own times: of a camera the time of day, of a file as though it had been played.

mod journal;
mod shelf;
mod sink;
mod span;
mod stamp;

pub(crate) use journal::{JOURNAL, listed};
pub(crate) use shelf::{Shelf, Stretch};
pub(crate) use sink::SegmentedSink;
pub use span::Span;

use crate::sinks::Format;
use serde::Serialize;

/// The overlay video.
pub(crate) const OVERLAY: &str = "overlay.mp4";
/// What happened.
pub(crate) const EVENTS: &str = "events.jsonl";
/// Clips of events.
pub(crate) const CLIP: &str = "clips/clip.mp4";
/// Pictures of events.
pub(crate) const SNAPSHOT: &str = "clips/snapshot.jpg";

/// All that is ever cut or kept for a time: nothing else is ever removed.
fn streams() -> impl Iterator<Item = &'static str> {
    [OVERLAY, EVENTS, CLIP, SNAPSHOT].into_iter().chain(Format::ALL.iter().map(|f| f.file_name()))
}

/// What `run.json` says of a run in segments.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct SegmentFacts {
    /// How long a segment is, seconds.
    pub every_s: Option<f64>,
    /// How long files are kept, seconds; for ever where it is absent.
    pub keep_s: Option<f64>,
    /// The segments that there are, of this run and of those before it in the folder, the oldest first.
    pub files: Vec<String>,
    /// How many clips and pictures of events there are.
    pub clips: usize,
    /// How many files have been removed because they were old.
    pub removed: u64,
    /// Where all of them are listed.
    pub list: &'static str,
}
