//! Visual target tracking: point it at a video, a camera or a scene, give it a box or let it find the mover, and it says
//! for every frame where the target is, how sure it is, and whether it is measuring, coasting or has lost it.
//!
//! This crate is what users depend on. It re-exports the floors below and adds the one run loop: a [`Session`] reads a
//! source, follows the targets and feeds the sinks; a [`Run`] does that for a [`RunConfig`] and leaves its files in a
//! folder.

mod accuracy;
pub mod config;
mod demo;
mod error;
mod input;
mod record;
mod run_file;
mod session;
pub mod sinks;
mod timing;
mod track;
mod trajectory_plots;

pub use accuracy::{Accuracy, AccuracyMeter};
pub use config::RunConfig;
pub use demo::Demo;
pub use error::RunError;
pub use record::Record;
pub use run_file::{HostFacts, InputFacts, RecipeFacts, RunFile, StateCounts, TimingFacts};
pub use session::{Outcome, Progress, Session, Start};
pub use timing::{Timing, TimingSummary};
pub use track::{Finished, Run};

pub use pursuit_charts as charts;
pub use pursuit_estimation as estimation;
pub use pursuit_evaluation as evaluation;
pub use pursuit_geometry as geometry;
pub use pursuit_imaging as imaging;
pub use pursuit_media as media;
pub use pursuit_scenes as scenes;
pub use pursuit_tracking as tracking;
pub use pursuit_vision as vision;
