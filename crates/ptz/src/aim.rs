use pursuit_geometry::BBox;
use pursuit_tracking::{BoxCovariance, Estimate, TrackState};

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

impl Aim {
    /// What a tracker said of a target, so many seconds later: what it said itself for none, `forecast` for more.
    pub fn ahead(
        said: &Estimate,
        seconds: f64,
        forecast: impl FnOnce(f64) -> Option<pursuit_tracking::Forecast>,
    ) -> Option<Self> {
        let Estimate { bbox, covariance, state, .. } = *said;
        if seconds <= 0.0 {
            return Some(Self { bbox, covariance, state });
        }
        forecast(seconds).map(|ahead| Self { bbox: ahead.bbox, covariance: ahead.covariance, state })
    }
}

/// What a tracker says of one target after a frame: a box as a function of time.
///
/// Boxes are in the pixels of the camera **as it stood when that frame was taken**: a forecast does not know how the head
/// will move. A tracker that takes the head's motion for the target's is wrong about later times: it is to be told how the
/// camera stood (`motion.camera = pose`), or the [`Follower`](crate::control::Follower) predicts by itself, from directions in
/// the world.
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
