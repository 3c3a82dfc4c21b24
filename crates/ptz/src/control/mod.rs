//! Controllers: from what the tracker sees to what the head shall do.
//!
//! [`Follower`] keeps the target in the middle of the picture. It knows, from the commands it has given, where the head
//! stands now, stood when a picture was taken, and will stand when a command arrives; and it knows from the target's
//! directions in the world where the target will be then.

mod baselines;
mod believed_head;
mod controller;
mod dead_zone;
mod departure;
mod diagnosis;
mod follower;
mod head_model;
mod jitter;
mod lateness;
mod lost;
mod own_word;
mod params;
mod prediction;
mod rehearsal;
mod servo;
mod sighting;
mod steps;
mod target_motion;
mod zones;
mod zoom;

pub use baselines::{Proportional, StopAndGo};
pub use believed_head::BelievedHead;
pub use controller::Controller;
pub use departure::Departure;
pub use diagnosis::{Diagnosis, Mode};
pub use follower::Follower;
pub use head_model::HeadModel;
pub use jitter::Jitter;
pub use lateness::Lateness;
pub use lost::{LostParams, LostPolicy};
pub use own_word::{Honesty, OwnWord};
pub use params::{AimPoint, AtEnd, EndParams, FollowerParams, MotionParams, NearParams, PredictBy, Scheme, Subject};
pub use rehearsal::TrustParams;
pub use target_motion::{SeenAt, TargetBelief, TargetMotion};
pub use zones::{Rule, Zone, ZoneList};
pub use zoom::ZoomParams;
