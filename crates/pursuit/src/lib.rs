//! Visual target tracking: point it at a video, a camera or a scene, give it a box or let it find the mover, and it says
//! for every frame where the target is, how sure it is, and whether it is measuring, coasting or has lost it.
//!
//! ```
//! use pursuit::{BBox, open, recipe, track};
//!
//! # fn main() -> Result<(), pursuit::RunError> {
//! // A video file, a folder of images, a camera (`camera:0`), or, as here, a scene made on the spot.
//! let source = open("scene:drift?seed=7&duration=1")?;
//! let target = BBox::from_ltwh(145.5, 105.5, 30.0, 30.0);
//! for estimate in track(source, &*recipe("pursuit")?, target) {
//!     let e = estimate?;
//!     println!("{:.2} s: {} {:.2} {}", e.time_s, e.state, e.score, e.bbox);
//! }
//! # Ok(())
//! # }
//! ```
//!
//! This crate is what users depend on. [`track`] follows one target; a [`Session`] is the one run loop, a frame a step: it
//! reads a source, follows any number of targets, feeds sinks, and can be commanded meanwhile; a [`Run`] does that for a
//! [`RunConfig`] and leaves its files in a folder. The floors below are re-exported: [`tracking`] has the words,
//! [`trackers`] the trackers and detectors by name.

/// The program of the guide runs as it stands.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/guide/own-tracker.md")]
mod own_tracker {}

pub mod associate;
pub mod batch;
pub mod cameras;
mod compare;
pub mod config;
mod demo;
mod error;
pub mod events;
mod features;
mod fetched;
mod folder_sinks;
mod follow;
#[cfg(feature = "ptz")]
pub mod head;
mod input;
#[cfg(feature = "mavlink")]
pub mod mavlink;
pub mod measure;
pub mod publish;
mod record;
mod resume;
pub mod revise;
pub mod run;
mod run_folder;
mod segments;
pub mod session;
pub mod sinks;
mod start;
mod timing;
mod track;
mod trajectory_plots;
mod view;

pub use compare::ComparedFacts;
pub use config::RunConfig;
pub use demo::Demo;
pub use error::RunError;
pub use features::{FEATURES, NO_OVERLAY};
pub use fetched::Fetched;
pub use follow::{Follow, frames, open, open_with, recipe, track};
pub use pursuit_geometry::BBox;
pub use pursuit_imaging::Frame;
pub use pursuit_media::View;
pub use pursuit_tracking::{Doubt, Estimate, Recipe, TrackState, Tracker};
pub use record::Record;
pub use segments::{SegmentFacts, Span};
pub use session::{Command, Outcome, Progress, Remote, Session};
pub use start::StartFrom;
pub use track::{Finished, Run};
pub use view::{Resize, part_of};

pub use pursuit_address as address;
pub use pursuit_charts as charts;
pub use pursuit_estimation as estimation;
pub use pursuit_evaluation as evaluation;
pub use pursuit_geometry as geometry;
pub use pursuit_imaging as imaging;
pub use pursuit_inference as inference;
pub use pursuit_measuring as measuring;
pub use pursuit_media as media;
pub use pursuit_parameters as parameters;
#[cfg(feature = "ptz")]
pub use pursuit_ptz as ptz;
pub use pursuit_scenes as scenes;
pub use pursuit_trackers as trackers;
pub use pursuit_tracking as tracking;
pub use pursuit_vision as vision;

// Types of these crates stand in public signatures.
pub use {nalgebra, toml};
