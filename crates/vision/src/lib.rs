//! Pure functions and small state machines on images: colour, filtering, morphology, regions, sampling, features.
//!
//! Every fast kernel has a slow, obvious twin in its tests. Scratch is passed in or owned by a value made once, so that
//! nothing is allocated per frame.

pub mod background;
pub mod color;
pub mod contour;
pub mod enclosing;
mod error;
pub mod features;
pub mod flow;
pub mod fourier;
pub mod global_motion;
pub mod hog;
pub mod integral;
pub mod morphology;
pub mod patch;
pub mod region_features;
pub mod regions;
pub mod sampling;
pub mod segmentation;
pub mod smoothing;
pub mod warp;
mod window;

pub use error::VisionError;
pub use window::PixelWindow;

/// The result of a fallible operation of this crate.
pub type Result<T, E = VisionError> = std::result::Result<T, E>;
