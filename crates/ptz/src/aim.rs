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

    /// Several targets as one: the box around all that are not lost, measured where any of them is. One alone stays what it is.
    pub fn around(targets: impl Iterator<Item = Self>) -> Option<Self> {
        targets.reduce(|all, next| match (all.state, next.state) {
            (_, TrackState::Lost) => all,
            (TrackState::Lost, _) => next,
            (a, b) => {
                let is_measured = a == TrackState::Tracking || b == TrackState::Tracking;
                let state = if is_measured { TrackState::Tracking } else { a };
                // The edges of several boxes err by no one's covariance.
                Self { bbox: all.bbox.union(&next.bbox), covariance: None, state }
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn aim(left: f64, state: TrackState) -> Aim {
        Aim { bbox: BBox::from_ltwh(left, 10.0, 20.0, 40.0), covariance: None, state }
    }

    #[test]
    fn several_targets_are_followed_as_one() {
        let all = |aims: &[Aim]| Aim::around(aims.iter().copied());
        let (seen, hidden, lost) = (TrackState::Tracking, TrackState::Occluded, TrackState::Lost);
        let both = all(&[aim(0.0, hidden), aim(100.0, seen)]).unwrap();
        assert_eq!((both.bbox, both.state), (BBox::from_ltwh(0.0, 10.0, 120.0, 40.0), seen));
        assert_eq!(all(&[aim(0.0, lost), aim(100.0, hidden)]), Some(aim(100.0, hidden)));
        assert_eq!(all(&[aim(0.0, seen), aim(100.0, lost)]), Some(aim(0.0, seen)));
        assert_eq!(all(&[aim(0.0, lost), aim(9.0, lost)]).unwrap().state, lost);
        assert_eq!(all(&[]), None);
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
