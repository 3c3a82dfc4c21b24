//! Borrowed views and owned images, pixel types, and [`Frame`]: one moment of a video, whose derived planes (grey,
//! colour, anything a tracker wants to share) are computed once, on demand, and shared by all targets.

mod error;
mod frame;
mod image;
mod yuv;

pub use error::ImagingError;
pub use frame::{Frame, Pixels};
pub use image::{Image, ImageView, Rgb8};
pub use yuv::{ColorMatrix, ColorRange, Yuv420};

/// The result of a fallible imaging operation.
pub type Result<T, E = ImagingError> = std::result::Result<T, E>;
