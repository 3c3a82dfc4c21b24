//! Pan-tilt-zoom heads: the geometry between pixels and angles, controllers that aim where the target **will be** when the
//! head arrives, drivers for the protocols that heads speak, simulated heads, and their calibration.
//!
//! A [`Follower`](control::Follower) is told what the tracker sees in each frame as a [`Forecast`] (a box as a function of
//! time) and says what the head shall do as a [`Command`]. A [`Head`](drivers::Head) carries commands out: a camera
//! reached by ONVIF, VISCA or Pelco-D, a user's own program, or a [`SimulatedHead`](simulation::SimulatedHead).
//! [`HeadThread`](drivers::HeadThread) puts a head on a thread of its own, where a slow camera delays nobody, and stops it
//! when commands cease.
//!
//! Angles are in degrees: pan grows to the right, tilt grows **upward**. Zoom is a position from 0 (widest) to 1
//! (longest). Time is always an argument, in seconds.

mod aim;
pub mod calibration;
mod command;
pub mod control;
pub mod drivers;
mod error;
pub mod geometry;
pub mod mechanics;
pub mod simulation;

pub use aim::{Aim, Forecast, Still};
pub use command::{Command, Position, Status, Velocity};
pub use error::PtzError;
pub use geometry::Direction;

/// The result of a fallible operation on a head.
pub type Result<T, E = PtzError> = std::result::Result<T, E>;
