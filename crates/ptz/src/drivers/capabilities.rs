use serde::{Deserialize, Serialize};

/// What a head can do.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Capabilities {
    /// To move at a velocity.
    pub velocity: bool,
    /// To go to a direction.
    pub absolute: bool,
    /// To turn by an angle.
    pub relative: bool,
    /// To zoom.
    pub zoom: bool,
    /// To go to stored positions.
    pub presets: bool,
    /// To say where it stands.
    pub status: bool,
    /// The greatest speeds of pan and of tilt, degrees per second, where known.
    pub max_speed_deg_s: Option<(f64, f64)>,
}
