/// What a camera says of itself.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraFacts {
    /// Who made it.
    pub vendor: String,
    /// What it is.
    pub model: String,
    /// Width and height of its pictures, pixels.
    pub size: (u16, u16),
    /// How wide it sees, from the left to the right edge, degrees, where known.
    pub field_of_view_deg: Option<f64>,
    /// Pictures a second, where known.
    pub fps: Option<f64>,
    /// Where its pictures can be had, where they can.
    pub stream: Option<Stream>,
    /// How far a camera that no gimbal turns looks above the vehicle's nose, degrees; below it is negative.
    pub pitch_deg: f64,
    /// Whether `LANDING_TARGET` is sent while the target is seen; it needs the field of view.
    pub landing_target: bool,
    /// The true width of the target, metres, where known: distances follow.
    pub target_width_m: Option<f64>,
    /// The gimbal that it sits on, by its component, 0 for none.
    pub gimbal_device: u8,
}

/// Where a camera's pictures can be had.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stream {
    /// An address without any password; at most 159 bytes of it are said.
    pub uri: String,
}

impl CameraFacts {
    /// The tangents of half the picture's width and height, where the field of view is known.
    pub(crate) fn tangents(&self) -> Option<(f64, f64)> {
        let across = (0.5 * self.field_of_view_deg?.to_radians()).tan();
        let (width, height) = (f64::from(self.size.0.max(1)), f64::from(self.size.1));
        Some((across, across * height / width))
    }

    /// How high it sees, degrees, where the field of view is known.
    pub(crate) fn vertical_deg(&self) -> Option<f64> {
        self.tangents().map(|(_, up)| 2.0 * up.atan().to_degrees())
    }
}
