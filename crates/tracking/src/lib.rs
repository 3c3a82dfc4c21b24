//! The vocabulary of tracking, the single-target loop, and every tracker, one folder each.
//!
//! For a user: pick a [`Recipe`] from the [`registry`], [`init`](Recipe::init) it on a frame and a box, then call
//! [`Tracker::update`] for every further frame and read the [`Estimate`]: where the target is, how sure the tracker is,
//! and whether it is measuring, coasting or has lost it.
//!
//! For an implementer: a tracker is a filling of [`SingleTarget`], the one loop *predict → search → judge → correct or
//! coast → learn*: a [`Localizer`] that finds, a [`Policy`] that judges, a [`MotionFilter`] that predicts and corrects.

pub mod ball;
pub mod correlation;
pub mod dsst;
mod error;
mod estimate;
pub mod kcf;
pub mod mosse;
pub mod motion;
pub mod parameters;
pub mod policy;
pub mod pursuit;
pub mod registry;
pub mod regularised;
mod roles;
pub mod scale;
mod single_target;
mod snapshot;
pub mod staple;
mod target_set;
mod tracker;

pub use error::TrackingError;
pub use estimate::{BoxCovariance, Diagnostics, Estimate, TrackState};
pub use roles::{
    Detection, Detector, Evidence, Localizer, Measurement, MotionFilter, Policy, Prior, Proposer, Search, Verdict,
};
pub use single_target::SingleTarget;
pub use target_set::{TargetId, TargetSet};
pub use tracker::{DetectorRecipe, Recipe, Tracker, TrackerRecipe, check_box};

/// The result of a fallible tracking operation.
pub type Result<T, E = TrackingError> = std::result::Result<T, E>;
