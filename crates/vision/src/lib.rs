//! Pure functions and small state machines on images: colour, filtering, morphology, regions, sampling, features.
//!
//! Every fast kernel has a slow, obvious reference in its tests. Scratch is passed in or owned by a value made once, so that
//! nothing is allocated per frame.
//!
//! ```
//! use pursuit_imaging::Image;
//! use pursuit_vision::regions::RegionFinder;
//! use pursuit_vision::segmentation::threshold;
//!
//! // A bright square of 4 x 4 pixels on a dark ground, and a bright speck.
//! let image = Image::from_fn(32, 24, |x, y| {
//!     let square = (10..14).contains(&x) && (6..10).contains(&y);
//!     if square || (x, y) == (30, 2) { 200u8 } else { 20 }
//! })?;
//! let mut mask = Image::filled(1, 1, 0)?;
//! threshold(image.view(), 100, &mut mask)?;
//! let mut finder = RegionFinder::default();
//! let regions = finder.find(mask.view(), 4); // of at least four pixels
//! assert_eq!(regions.len(), 1);
//! assert_eq!(regions[0].area, 16);
//! # Ok::<(), pursuit_imaging::ImagingError>(())
//! ```

pub mod background;
pub mod color;
pub mod color_mixture;
pub mod contour;
pub mod corner;
pub mod cut;
pub mod enclosing;
mod error;
pub mod features;
pub mod flow;
pub mod fourier;
pub mod global_motion;
pub mod hog;
pub mod illumination;
pub mod integral;
pub mod morphology;
pub mod patch;
pub mod region_features;
pub mod regions;
pub mod sampling;
pub mod segmentation;
pub mod smoothing;
pub mod template_match;
pub mod warp;
mod window;

pub use error::VisionError;
pub use window::PixelWindow;

/// The result of a fallible operation of this crate.
pub type Result<T, E = VisionError> = std::result::Result<T, E>;
