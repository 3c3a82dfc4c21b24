//! The ball system of paper `ball`: colour, shape and a Kalman filter, as tracker and as detector.
//!
//! Detection follows the paper stage by stage: Gaussian smoothing, HSV, colour range, erosion and dilation, binary mask,
//! regions with area, perimeter and bounding rectangle, the smallest enclosing rectangle. Tracking adds what a real video
//! needs: the candidate nearest to the prediction inside the gate of the innovation covariance, streaks of a fast ball,
//! balls that are partly hidden, coasting while it is not seen, and strict conditions for taking something for the ball
//! that has come back. See `docs/papers/ball.md`.

mod appearance;
mod detector;
mod eye;
mod localizer;
mod motion;
mod palette;
mod params;
mod policy;
mod rivals;

pub use localizer::BallLocalizer;
pub use motion::BallMotion;
pub use palette::BallColor;
pub use params::{BallDetectorParams, BallMotionMode, BallParams};
pub use policy::{BallPolicy, BallProposer};

use crate::{Result, SingleTarget, TrackerRecipe, TrackingError, parameters::Parameters};
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;

/// The ball tracker: the one loop with colour, shape and motion of a ball.
pub type BallTracker = SingleTarget<BallProposer, BallLocalizer, BallPolicy, BallMotion>;

impl TrackerRecipe for BallParams {
    type Tracker = BallTracker;

    const SUMMARY: &'static str = "a ball (or anything of one colour) by colour and shape, with a filter for bounces";
    const PAPER: &'static str = "ball";
    const NEEDS_COLOR: bool = true;

    fn start(&self, frame: &Frame, bbox: BBox) -> Result<Self::Tracker> {
        let motion = BallMotion::new(self.motion, bbox).map_err(|e| TrackingError::Computation {
            tracker: Self::OWNER,
            index: frame.index(),
            source: Box::new(e),
        })?;
        let localizer = BallLocalizer::new(self, frame, bbox)?;
        Ok(SingleTarget::new(Self::OWNER, frame, BallProposer::new(self), localizer, BallPolicy::new(self), motion))
    }

    fn revive(&self, saved: Self::Tracker) -> Result<Self::Tracker> {
        saved.revived(Self::OWNER, |_, localizer, _, _| {
            if !localizer.is_sound() {
                let problem = "its numbers do not fit each other".to_owned();
                return Err(TrackingError::Snapshot { tracker: Self::OWNER, problem });
            }
            localizer.revive();
            Ok(())
        })
    }
}
