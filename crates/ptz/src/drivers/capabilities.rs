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
    /// How far it turns, where it says so itself; such a head also says truly where it stands at the beginning.
    pub travel: Option<Travel>,
    /// The greatest speeds of pan and of tilt, degrees per second, where known.
    pub max_speed_deg_s: Option<(f64, f64)>,
}

/// How far a head turns, degrees.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Travel {
    /// Least and greatest pan.
    pub pan_deg: (f64, f64),
    /// Least and greatest tilt.
    pub tilt_deg: (f64, f64),
}
