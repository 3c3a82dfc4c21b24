use crate::{Direction, Position, Velocity};
use std::fmt;

/// What a follower is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// No target has been seen yet.
    Waiting,
    /// Follows a target that is measured.
    Following,
    /// Follows a target that is predicted.
    Coasting,
    /// The target is lost; the policy for that is carried out.
    Lost,
    /// A person drives the head.
    Manual,
}

/// What a follower thinks, for people to read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Diagnosis {
    /// What it is doing.
    pub mode: Mode,
    /// Where the target is predicted to be when the next command takes effect.
    pub target: Option<Direction>,
    /// Where the head is believed to look then.
    pub head: Position,
    /// How fast the head is believed to turn then.
    pub turning: Velocity,
}

impl fmt::Display for Diagnosis {
    /// What the head is believed to do.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mode = match self.mode {
            Mode::Waiting => "waits for a target",
            Mode::Following => "follows",
            Mode::Coasting => "follows the prediction",
            Mode::Lost => "has lost the target",
            Mode::Manual => "is driven by hand",
        };
        let Position { direction, zoom } = self.head;
        write!(f, "head {mode}: pan {:.1}°, tilt {:.1}°, zoom {zoom:.2}", direction.pan_deg, direction.tilt_deg)
    }
}
