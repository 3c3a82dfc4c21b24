//! The arithmetic of Siamese trackers: a network compares a crop around the target of the first frame with a crop
//! around where it is looked for; what it answers is decoded here.
//!
//! Equations and conventions are those of NanoTrack's released tracker (github.com/HonglinChu/SiamTrackers, commit
//! 4dbbbbc, `nanotrack/tracker`), which are those of SiamRPN (Li et al. 2018, section 4.3) and PySOT. Nothing here
//! keeps a target's state: where it is and how large it is are arguments.

mod config;
mod crop;
mod decode;
mod description;
mod embedding;
mod mask;
mod network;
mod scales;
mod tracker;

pub use config::{
    AnswerCoding, BoxRule, ChannelOrder, CropShape, Fill, ScoreCoding, SiameseConfig, SiameseParams, Ties, WindowUse,
};
pub use crop::{Cropper, Region};
pub use decode::{Decoder, Location, Peak};
pub use description::SiameseDescription;
pub use embedding::Embedding;
pub use mask::DrawnMask;
pub use network::{Answer, SiameseNetwork, Sides};
pub use tracker::{Exemplar, SiameseTracker};
