//! Pure functions and small state machines on images: colour, filtering, morphology, regions, sampling, features.
//!
//! Every fast kernel has a slow, obvious twin in its tests. Scratch is passed in or owned by a value made once, so that
//! nothing is allocated per frame.

pub mod color;
pub mod contour;
pub mod enclosing;
pub mod features;
pub mod fourier;
pub mod hog;
pub mod morphology;
pub mod regions;
pub mod sampling;
pub mod segmentation;
pub mod smoothing;
mod window;

pub use window::PixelWindow;
