//! A run as a camera of a drone: ground stations say what to track, and are told what becomes of it.

mod options;
mod sink;
mod steering;

pub use options::{Mavlink, MavlinkOptions};
pub use sink::CameraSink;

pub use pursuit_mavlink::{Endpoint, Identity, LinkAddress, LinkCounts, SigningKey};
