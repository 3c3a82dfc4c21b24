//! What happens, for whoever does not look all the time: targets that appear and are lost, zones that are entered, dwelt in and
//! left; how many are where; clips and pictures of it.
//!
//! A target counts as present only while it is seen (`tracking`, `unsure`), and for [`EventOptions::unseen_s`] after that. One
//! that is hidden or lost for longer is told to be unseen and counts nowhere, whatever its predicted box says.

mod clips;
#[cfg(feature = "publish")]
mod counts;
mod file;
mod message;
mod options;
#[cfg(feature = "encode")]
mod recorder;
mod switch;
mod watcher;
mod zone;

pub(crate) use clips::ClipPlan;
#[cfg(feature = "publish")]
pub(crate) use counts::counts;
pub(crate) use file::EventFile;
#[cfg(feature = "publish")]
pub(crate) use message::EventMessage;
pub(crate) use options::EventRules;
pub use options::{Anchor, EventOptions};
#[cfg(feature = "encode")]
pub(crate) use recorder::RecorderSink;
pub(crate) use watcher::Watcher;
pub use zone::Zone;

use crate::RunError;
use pursuit_geometry::BBox;
use pursuit_tracking::{Class, TargetId};
use std::path::PathBuf;
use std::str::FromStr;
use std::sync::Arc;

/// Kinds of what happens.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A target is seen for the first time.
    Appear,
    /// A target came into a zone.
    Enter,
    /// A target has been in a zone for as long as was asked for.
    Dwell,
    /// A target is no longer in a zone.
    Leave,
    /// A target has not been seen for a while.
    Lost,
    /// A lost target is seen again.
    Found,
    /// There is no such target any more.
    Gone,
}

impl Kind {
    /// All of them.
    pub const ALL: [Self; 7] =
        [Self::Appear, Self::Enter, Self::Dwell, Self::Leave, Self::Lost, Self::Found, Self::Gone];

    /// The word that messages and options use.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Appear => "appear",
            Self::Enter => "enter",
            Self::Dwell => "dwell",
            Self::Leave => "leave",
            Self::Lost => "lost",
            Self::Found => "found",
            Self::Gone => "gone",
        }
    }
}

impl FromStr for Kind {
    type Err = RunError;

    /// # Errors
    /// [`RunError::Usage`] for a word that is none.
    fn from_str(word: &str) -> Result<Self, RunError> {
        Self::ALL.into_iter().find(|kind| kind.as_str() == word).ok_or_else(|| {
            let all = Self::ALL.map(Self::as_str).join(", ");
            RunError::usage(format!("there are no events `{word}`; there are: {all}"))
        })
    }
}

/// Why a target is no longer in a zone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reason {
    /// It was seen outside.
    Left,
    /// It has not been seen for a while: where it is nobody knows.
    Unseen,
    /// There is no such target any more.
    Gone,
}

impl Reason {
    /// The word that messages use.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Left => "left",
            Self::Unseen => "unseen",
            Self::Gone => "gone",
        }
    }
}

/// Something that happened.
#[derive(Debug, Clone, PartialEq)]
pub struct Event {
    /// What.
    pub kind: Kind,
    /// Number and time, in seconds, of the frame in which it was known.
    pub frame: u64,
    /// See `frame`.
    pub time_s: f64,
    /// When that frame was looked at, seconds since 1970.
    pub unix_time_s: f64,
    /// The target.
    pub target: TargetId,
    /// What a detector takes it for.
    pub class: Option<Class>,
    /// The zone, of what happens in zones.
    pub zone: Option<Arc<str>>,
    /// Why it left a zone.
    pub reason: Option<Reason>,
    /// How long it has been in the zone, or in sight, seconds: of one that left or is lost, until it was seen there last.
    pub lasted_s: Option<f64>,
    /// Where it was seen last, in pixels of the input.
    pub bbox: Option<BBox>,
}

/// Who is where, among those who are seen.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Occupancy {
    /// The zone; none is the whole picture.
    pub zone: Option<Arc<str>>,
    /// Who is there.
    pub present: Vec<(TargetId, Option<Class>)>,
    /// Who was last seen there and is not seen now: they do not count as present.
    pub unseen: Vec<TargetId>,
}

/// What is known of a frame beyond its records.
#[derive(Debug, Clone, Default)]
pub struct Watched {
    /// What happened.
    pub events: Vec<Event>,
    /// Who is where: the whole picture, then each zone.
    pub occupancies: Vec<Occupancy>,
    /// The clip that this frame belongs to.
    pub(crate) clip: Option<Arc<PathBuf>>,
    /// Where a picture of this frame goes.
    pub(crate) snapshot: Option<PathBuf>,
}
