//! MAVLink for a camera that tracks: what a ground station asks of it, what it says, and the gimbal it sits on.
//!
//! An [`Endpoint`] is one component of one vehicle on one link or several ([`LinkAddress`]): it connects again when a link
//! breaks, hands on what is meant for it, and ignores everything that is no valid message. A [`Camera`] on it speaks the camera protocol: it answers what it is asked about
//! itself, hands on what it is asked to track ([`Request`]), and says at the rate asked for what has become of that
//! ([`Tracking`]). A [`Gimbal`] on it finds a gimbal manager, takes control, and turns. [`Vehicle`] is what the autopilot says of attitude and
//! position.
//!
//! This crate knows nothing of pictures: places in them are parts of their width and height. Angles are in degrees, times in seconds.

mod address;
mod camera;
mod command;
mod endpoint;
mod error;
mod gimbal;
mod ground;
mod link;
mod rotation;
mod vehicle;
mod wire;

pub use address::LinkAddress;
pub use camera::{Ask, Camera, CameraFacts, Place, Request, Stream, Tracking, Verdict};
pub use endpoint::{Endpoint, Identity, Incoming, LinkCounts};
pub use error::MavlinkError;
pub use gimbal::{Attitude, AttitudeWatch, Gimbal, GimbalId, GimbalLimits};
pub use mavlink::dialects::common as messages;
pub use vehicle::{Position, Vehicle};
pub use wire::SigningKey;

/// The result of what can go wrong with a link or a gimbal.
pub type Result<T, E = MavlinkError> = std::result::Result<T, E>;
