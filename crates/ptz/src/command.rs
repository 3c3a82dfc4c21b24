use crate::geometry::Direction;
use serde::{Deserialize, Serialize};

/// How fast a head shall move.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Velocity {
    /// Degrees per second, to the right.
    pub pan_deg_s: f64,
    /// Degrees per second, upward.
    pub tilt_deg_s: f64,
    /// Of the whole zoom range per second, positive: longer.
    pub zoom_per_s: f64,
}

impl Velocity {
    /// Standing still.
    pub const ZERO: Self = Self { pan_deg_s: 0.0, tilt_deg_s: 0.0, zoom_per_s: 0.0 };

    /// Whether every component is a finite number.
    pub const fn is_finite(&self) -> bool {
        self.pan_deg_s.is_finite() && self.tilt_deg_s.is_finite() && self.zoom_per_s.is_finite()
    }

    /// Whether nothing moves.
    pub fn is_zero(&self) -> bool {
        *self == Self::ZERO
    }
}

pursuit_parameters::parameters! {
    /// Where a head stands.
    #[derive(Copy)]
    pub struct Position {
        /// The direction of the optical axis.
        pub direction: Direction = Direction::AHEAD;
        /// Zoom position, 0 the widest.
        pub zoom: f64 = 0.0, in 0.0..=1.0;
    }
}

/// What a head is told to do.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "command", rename_all = "snake_case")]
pub enum Command {
    /// Move at this velocity until told otherwise.
    Move(Velocity),
    /// Go to this direction; a zoom of `None` stays as it is.
    GoTo {
        /// Where to look.
        direction: Direction,
        /// Zoom position in `[0, 1]`.
        zoom: Option<f64>,
    },
    /// Turn by this much from where the head stands.
    TurnBy {
        /// Degrees to the right and upward.
        by: Direction,
    },
    /// Go to a stored position.
    Preset {
        /// Its number, as the head counts.
        number: u8,
    },
    /// Go to the head's home position.
    Home,
    /// Stop moving.
    Stop,
}

impl Command {
    /// Whether every number in it is finite and the zoom lies in `[0, 1]`.
    pub fn is_sound(&self) -> bool {
        match self {
            Self::Move(velocity) => velocity.is_finite(),
            Self::GoTo { direction, zoom } => {
                direction.is_finite() && zoom.is_none_or(|zoom| (0.0..=1.0).contains(&zoom))
            }
            Self::TurnBy { by } => by.is_finite(),
            Self::Preset { .. } | Self::Home | Self::Stop => true,
        }
    }

    /// Whether a head that obeys it may be moving afterwards.
    pub fn moves(&self) -> bool {
        match self {
            Self::Move(velocity) => !velocity.is_zero(),
            Self::Stop => false,
            _ => true,
        }
    }

    /// Whether a head that obeys it moves until it is told otherwise; other ways end by themselves.
    pub fn runs_on(&self) -> bool {
        matches!(self, Self::Move(_)) && self.moves()
    }
}

/// What a head says of itself. Heads lie: some never say that they stand, some give an old position.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Status {
    /// Where it says it stands.
    pub position: Option<Position>,
    /// Whether it says that it moves.
    pub moving: Option<bool>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unsound_commands_are_told() {
        let nan = f64::NAN;
        let go = |pan, zoom| Command::GoTo { direction: Direction::new(pan, 0.0), zoom };
        assert!(go(1.0, Some(1.0)).is_sound() && go(1.0, None).is_sound());
        assert!(!go(nan, None).is_sound() && !go(1.0, Some(1.1)).is_sound() && !go(1.0, Some(-0.1)).is_sound());
        for axis in 0..3 {
            let part = |i| if i == axis { f64::INFINITY } else { 0.0 };
            let velocity = Velocity { pan_deg_s: part(0), tilt_deg_s: part(1), zoom_per_s: part(2) };
            assert!(!Command::Move(velocity).is_sound());
        }
        assert!(!Command::TurnBy { by: Direction::new(0.0, nan) }.is_sound());
        assert!(Command::Stop.is_sound() && Command::Home.is_sound() && Command::Preset { number: 3 }.is_sound());
    }

    #[test]
    fn what_moves_is_told() {
        assert!(!Command::Stop.moves() && !Command::Move(Velocity::ZERO).moves());
        let turns = Command::Move(Velocity { zoom_per_s: 0.1, ..Velocity::ZERO });
        assert!(turns.runs_on() && !Command::Move(Velocity::ZERO).runs_on() && !Command::Home.runs_on());
        assert!(Command::Home.moves() && turns.moves());
    }

    #[test]
    fn commands_are_written_as_documented() {
        let text = serde_json::to_string(&Command::Move(Velocity { pan_deg_s: 1.5, ..Velocity::ZERO })).unwrap();
        assert_eq!(text, r#"{"command":"move","pan_deg_s":1.5,"tilt_deg_s":0.0,"zoom_per_s":0.0}"#);
        let go = Command::GoTo { direction: Direction::new(1.0, -2.0), zoom: None };
        let text = serde_json::to_string(&go).unwrap();
        assert_eq!(text, r#"{"command":"go_to","direction":{"pan_deg":1.0,"tilt_deg":-2.0},"zoom":null}"#);
        assert_eq!(serde_json::from_str::<Command>(&text).unwrap(), go);
        assert_eq!(serde_json::to_string(&Command::Stop).unwrap(), r#"{"command":"stop"}"#);
    }
}
