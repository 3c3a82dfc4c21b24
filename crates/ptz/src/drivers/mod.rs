//! Heads that can be reached: cameras by their protocols, and a user's own program.
//!
//! Drivers block, each call for a bounded time. [`HeadThread`] runs one on a thread of its own: telling it something takes
//! no time, the newest command wins, and the head is stopped when commands cease, when the program lets go of it, and when
//! it panics.

mod address;
mod by_turns;
mod capabilities;
#[cfg(feature = "mavlink")]
mod gimbal;
mod hook;
#[cfg(feature = "onvif")]
pub mod onvif;
mod password;
pub mod pelco_d;
mod pilot;
mod thread;
mod time;
pub mod visca;

pub use address::{Access, HeadAddress, certificate, open};
pub use by_turns::ByTurns;
pub use capabilities::{Capabilities, Travel};
#[cfg(feature = "mavlink")]
pub use gimbal::{AttitudeOf, GimbalHead};
pub use hook::Hook;
pub use password::Password;
pub use pilot::Pilot;
pub use thread::{HeadThread, Report};
pub use time::Timeouts;

use crate::{Command, Result, Status};

/// A head that carries out commands. Every call returns within the driver's time-out.
///
/// A driver that is dropped while its head may be moving stops it.
pub trait Head: Send {
    /// Its name for messages, without any password.
    fn name(&self) -> &str;

    /// What it can do.
    fn capabilities(&self) -> Capabilities;

    /// Carries out a command; returns when the head has taken it, not when it has arrived.
    ///
    /// # Errors
    /// Where the head cannot be reached, refuses, or cannot do such a thing.
    fn send(&mut self, command: &Command) -> Result<()>;

    /// What the head says of itself; `None` when it says nothing. Not to be trusted.
    ///
    /// # Errors
    /// Where the head cannot be reached or its answer makes no sense.
    fn status(&mut self) -> Result<Option<Status>>;

    /// Lets the head finish what it was told last when this driver is dropped.
    fn leave(&mut self);
}

impl<H: Head + ?Sized> Head for Box<H> {
    fn name(&self) -> &str {
        (**self).name()
    }

    fn capabilities(&self) -> Capabilities {
        (**self).capabilities()
    }

    fn send(&mut self, command: &Command) -> Result<()> {
        (**self).send(command)
    }

    fn status(&mut self) -> Result<Option<Status>> {
        (**self).status()
    }

    fn leave(&mut self) {
        (**self).leave();
    }
}
