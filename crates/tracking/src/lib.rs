//! The vocabulary of tracking, the single-target loop and its roles, many targets at once. No algorithm that looks at
//! pixels: those are in the crate above.
//!
//! For a user: pick a [`Recipe`] from a registry, [`init`](Recipe::init) it on a frame and a box, then call
//! [`Tracker::update`] for every further frame and read the [`Estimate`]: where the target is, how sure the tracker is,
//! and whether it is measuring, coasting or has lost it.
//!
//! For an implementer: a tracker is a [`Localizer`] that finds, made by a [`LocalizerRecipe`]; [`SingleTarget`] is the one
//! loop *predict → search → judge → correct or coast → learn* around it. [`motion`], [`policy`] and [`search`] are values
//! that any tracker is combined with.

mod belief;
mod class;
mod diagnostics;
mod error;
mod estimate;
mod localizer;
pub mod many;
pub mod motion;
pub mod policy;
mod recipe;
pub mod registry;
mod roles;
pub mod search;
mod searcher;
mod segmenting;
mod single_target;
mod snapshot;
mod tracker;

pub use belief::Belief;
pub use class::Class;
pub use diagnostics::{Diagnostics, Figure, Figures, Taken, Weight};
pub use error::TrackingError;
pub use estimate::{BoxCovariance, Doubt, Estimate, Forecast, NextSample, TrackState, Velocity};
pub use localizer::{Gate, Localizer, Look, Measurement, Outcome, Search, ViewSize, Weighed};
pub use many::{MultiTracker, TargetId, TargetSet, Track};
pub use recipe::{GroupParams, LocalizerRecipe, TrackerRecipe};
pub use registry::{DetectorEntry, DetectorRecipe, TrackerEntry};
pub use roles::{Detection, Detector, Embedder, Followed, Prior};
pub use searcher::{Appearance, Told};
pub use segmenting::{Segmenter, SegmenterRecipe, SegmentingRecipe};
pub use single_target::SingleTarget;
pub use toml::Table;
pub use tracker::{Needs, Recipe, Tracker, check_box};

/// The result of a fallible tracking operation.
pub type Result<T, E = TrackingError> = std::result::Result<T, E>;
