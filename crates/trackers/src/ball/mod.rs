//! The ball system of paper `ball`: colour, shape and a Kalman filter, as tracker and as detector.
//!
//! Detection follows the paper stage by stage: Gaussian smoothing, HSV, colour range, erosion and dilation, binary mask,
//! regions with area, perimeter and bounding rectangle, the smallest enclosing rectangle. Tracking adds what a real video
//! needs: the candidate nearest to the prediction inside the gate of the innovation covariance, streaks of a fast ball,
//! balls that are partly hidden, coasting while it is not seen, and strict conditions for taking something for the ball
//! that has come back. See `docs/papers/ball.md`.

mod appearance;
mod color_blobs;
mod detector;
mod distractors;
mod localizer;
mod palette;
mod params;

pub use localizer::BallLocalizer;
pub use palette::BallColor;
pub use params::{BallDetectorParams, BallParams, DistractorParams, SightParams};

use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_tracking::motion::MotionParams;
use pursuit_tracking::policy::{GatedParams, PolicyModel, PolicyParams};
use pursuit_tracking::search::{SearchModel, SearchParams};
use pursuit_tracking::{GroupParams, LocalizerRecipe, Needs, Result, TrackerRecipe};

impl LocalizerRecipe for BallParams {
    type Localizer = BallLocalizer;

    const NEEDS: Needs = Needs { color: true, file: false };

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<BallLocalizer> {
        BallLocalizer::new(self, frame, bbox)
    }
}

/// `ball`. `motion.model = "ball"` is the filter of the paper with its printed noise.
pub fn ball(name: &'static str) -> TrackerRecipe<BallParams> {
    let groups = GroupParams {
        motion: MotionParams::ball(),
        policy: PolicyParams {
            model: PolicyModel::Gated,
            occluded_below: 0.625,
            seen_from: 0.75,
            found_from: 0.75,
            gated: GatedParams { far_from: 0.925, ..GatedParams::default() },
            learn_from: 0.75,
            lost_after_s: 0.68,
            occluded_score: 0.4,
            ..PolicyParams::default()
        },
        search: SearchParams { model: SearchModel::Gate, ..SearchParams::default() },
    };
    TrackerRecipe { name, localizer: BallParams::default(), groups }
}

/// How balls that were detected move: the detector's boxes are less exact than the tracker's.
pub(crate) fn detected_motion() -> MotionParams {
    MotionParams { position_noise: 0.03, size_noise: 0.1, noise_floor_px: 0.5, ..MotionParams::ball() }
}
