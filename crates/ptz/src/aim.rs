use pursuit_geometry::BBox;
use pursuit_tracking::{BoxCovariance, TrackState};

/// Where a target is, or is forecast to be, in the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aim {
    /// The target's box, pixels.
    pub bbox: BBox,
    /// Covariance of centre x, centre y, width and height, px²; `None` where nothing is known of it.
    pub covariance: Option<BoxCovariance>,
    /// Whether the target was measured, is coasted, or is lost.
    pub state: TrackState,
}

/// What a tracker says of one target after a frame: a box as a function of time.
///
/// Boxes are in the pixels of the camera **as it stood when that frame was taken**: a forecast does not know how the head
/// will move, and a tracker that takes the head's motion for the target's must not be asked for later times (the
/// [`Follower`](crate::control::Follower) then predicts by itself, from directions in the world).
pub trait Forecast {
    /// The target at `time_s` seconds on the clock of the frames, at or after the time of the last frame; `None` where
    /// there is no target, or none at that time.
    fn at(&self, time_s: f64) -> Option<Aim>;
}

/// A forecast that knows of no motion: the same answer for every time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Still(pub Option<Aim>);

impl Forecast for Still {
    fn at(&self, _time_s: f64) -> Option<Aim> {
        self.0
    }
}

impl<F: Fn(f64) -> Option<Aim>> Forecast for F {
    fn at(&self, time_s: f64) -> Option<Aim> {
        self(time_s)
    }
}
