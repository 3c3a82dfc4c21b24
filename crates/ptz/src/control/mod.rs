//! Controllers: from what the tracker sees to what the head shall do.
//!
//! [`Follower`] keeps the target in the middle of the picture. It knows, from the commands it has given, where the head
//! stands now, stood when a picture was taken, and will stand when a command arrives; and it knows from the target's
//! directions in the world where the target will be then.

mod baselines;
mod dead_zone;
mod follower;
mod head_model;
mod jitter;
mod lateness;
mod lost;
mod params;
mod servo;
mod sighting;
mod steps;
mod target_motion;
mod trust;
mod zoom;

pub use baselines::{Proportional, StopAndGo};
pub use follower::{Controller, Diagnosis, Follower, Mode};
pub use head_model::HeadModel;
pub use jitter::Jitter;
pub use lateness::Lateness;
pub use lost::{LostParams, LostPolicy};
pub use params::{FollowerParams, MotionParams, PredictBy, Scheme};
pub use target_motion::{SeenAt, TargetBelief, TargetMotion};
pub use trust::TrustParams;
pub use zoom::ZoomParams;
