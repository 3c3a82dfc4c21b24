//! Objects of known classes that move before a camera that stands still: motion proposes at every frame, a network of the user's
//! confirms and names what it proposes every few frames, and motion carries names and boxes in between.

mod confirmed;
mod detector;
mod params;

pub use params::MovingObjectsParams;

use pursuit_tracking::motion::MotionParams;

/// Regions are what is measured: as of the detector `motion`.
pub(crate) fn detected_motion() -> MotionParams {
    super::motion::detected_motion()
}
