//! Objects of known classes (people, cars, animals …), found by a network in every frame by itself, so under a camera that
//! moves too. The network is the user's: an ONNX file, YOLOX as exported or one described beside it. See
//! `docs/guide/networks.md`.

mod detector;
mod params;

pub use params::{ClassNames, ObjectsParams};

use pursuit_tracking::many::ManyParams;
use pursuit_tracking::motion::MotionParams;

/// How people and vehicles move, and how exactly a small network draws their boxes.
pub(crate) fn detected_motion() -> MotionParams {
    ManyParams::default().motion
}
