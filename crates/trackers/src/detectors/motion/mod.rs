//! What moves in front of a camera that stands still (qu2010, section 2): a background model, morphology, regions, and the
//! paper's matching rule on area, perimeter, aspect ratio and complexity.
//!
//! Beyond the paper: what is being followed is not learnt into the background, though it may stand still; a step of the
//! light does not flood the mask, and is said; a ghost (the background that a thing uncovers when it leaves the place it
//! was learnt at) is told from a thing by its edges, and learnt at once.

mod coarse;
mod colors;
mod detector;
mod found;
mod ghost;
mod groups;
mod held;
mod paper;
mod params;
mod scene;
mod shade;
mod stand;
mod surroundings;
mod turning;

pub use paper::PaperParams;
pub use params::{
    BackgroundKind, ColorsParams, GhostParams, GroupingParams, LightParams, MatchingParams, MotionDetectorParams,
    ShadeParams, StartParams,
};

use pursuit_tracking::motion::MotionParams;

/// How what moves is expected to move, and how exactly it is measured: regions fray.
pub(crate) fn detected_motion() -> MotionParams {
    MotionParams {
        acceleration: 2.0,
        start_speed: 2.0,
        position_noise: 0.06,
        size_noise: 0.25,
        noise_floor_px: 0.5,
        ..MotionParams::default()
    }
}
