//! Images and frames: [`Image`] owns pixels to change them, [`SharedImage`] shares finished ones (also those in anybody's
//! buffer), [`ImageView`] borrows them; [`Frame`] is one moment of a video with its depth and [`CameraPose`], whose derived
//! planes (grey, colour) are made once, on demand, and shared by all clones.

mod camera;
mod convert;
mod error;
mod frame;
mod image;
mod pixels;
mod reduce;
mod reducer;
mod shared;
mod yuv;

pub use camera::{CameraPose, Direction, Lens};
pub use error::ImagingError;
pub use frame::Frame;
pub use image::{Image, ImageView, Rgb8};
pub use pixels::Pixels;
pub use reducer::Reducer;
pub use shared::SharedImage;
pub use yuv::{ColorMatrix, ColorRange, Yuv420};

/// The result of a fallible imaging operation.
pub type Result<T, E = ImagingError> = std::result::Result<T, E>;
