//! Visual target tracking: point it at a video, a camera or a scene, give it a box or let it find the mover, and it says
//! for every frame where the target is, how sure it is, and whether it is measuring, coasting or has lost it.
//!
//! ```
//! use pursuit::{BBox, open, recipe, track};
//!
//! # fn main() -> Result<(), pursuit::RunError> {
//! // A video file, a folder of images, a camera (`camera:0`), or, as here, a scene made on the spot.
//! let source = open("scene:drift?seed=7&duration=1")?;
//! let target = BBox::from_ltwh(266.0, 170.0, 32.0, 32.0);
//! for estimate in track(source, &*recipe("pursuit")?, target) {
//!     let e = estimate?;
//!     println!("{:.2} s: {} {:.2} {}", e.time_s, e.state, e.score, e.bbox);
//! }
//! # Ok(())
//! # }
//! ```
//!
//! # What to take
//!
//! | you | take |
//! |---|---|
//! | follow one target | [`track`] |
//! | command a run while it goes on, follow many, feed your own sink | [`Session`], a frame a step |
//! | want the files that the command leaves | [`Run`] of a [`RunConfig`] |
//! | have frames, and call for each | [`Recipe::init`], then [`Tracker::update`] |
//! | have a detector of your own | [`tracking::many::Associating::fed`] |
//! | steer something that acts late | [`Tracker::forecast`]; a camera head: `head` (feature `ptz`) |
//! | put trajectories right by hand | [`revise`] |
//! | filter, smooth, associate without pictures | [`estimation`] |
//! | write a tracker | [`tracking::Localizer`] and [`tracking::LocalizerRecipe`] |
//! | compare trackers | [`evaluation`] |
//! | follow points, or every pixel | [`flow`] |
//!
//! With settings, frame by frame, and where the target will be in 0.2 s:
//!
//! ```
//! use pursuit::media::Source;
//! use pursuit::{open, recipe, toml};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let mut source = open("scene:drift?seed=7&duration=1")?;
//! let target = source.info().truth_at(0).bbox().ok_or("no target")?;
//! let first = source.next_frame()?.ok_or("no frame")?;
//! let settings: toml::Table = "motion.model = 'imm'".parse()?;
//! let mut tracker = recipe("kcf")?.with(&settings)?.init(&first, target)?;
//! while let Some(frame) = source.next_frame()? {
//!     let estimate = tracker.update(&frame)?;
//!     let ahead = tracker.forecast(0.2)?;
//!     println!("{} at {}, soon at {}", estimate.state, estimate.bbox, ahead.bbox);
//! }
//! # Ok(())
//! # }
//! ```
//!
//! Tracks from the boxes of your own detector, without pictures:
//!
//! ```
//! use pursuit::BBox;
//! use pursuit::tracking::Detection;
//! use pursuit::tracking::many::{Associating, ManyParams};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let mut targets = Associating::fed(ManyParams::default())?;
//! for k in 0..10 {
//!     let found = Detection::new(BBox::from_ltwh(100.0 + 4.0 * f64::from(k), 80.0, 40.0, 90.0), 0.9);
//!     for track in targets.update(f64::from(k) / 25.0, None, &[found])? {
//!         println!("target {}: {:?}", track.id, track.estimate.as_ref().map(|e| e.state));
//!     }
//! }
//! # Ok(())
//! # }
//! ```
//!
//! # The floors
//!
//! A crate imports only from floors below its own; all of them are re-exported here.
//!
//! ```text
//! 5  pursuit        the run loop, files, this front door
//! 4  trackers       everything that looks        evaluation   sequences, figures     ptz   heads
//! 3  tracking       the words and the loop       scenes       worlds with truth
//! 2  vision         image kernels                media        decoding, encoding     inference   networks
//! 1  imaging        images, frames               measuring    metres                 publish, mavlink
//! 0  geometry  estimation  parameters  charts  containers  address
//! ```
//!
//! The folder `examples` of the repository has eleven programs, the book (`docs`) the rest.

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
pub mod flow;
mod folder_sinks;
mod follow;
#[cfg(feature = "ptz")]
pub mod head;
mod input;
#[cfg(feature = "mavlink")]
pub mod mavlink;
pub mod measure;
pub mod networks;
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

/// The README's example is run with the documentation's own.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
