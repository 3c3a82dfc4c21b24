//! Bytes in and out of video containers: where in a file each compressed picture lies and when it is shown, and files
//! that play however they end. Nothing here decodes a picture.
//!
//! | container | reads | writes |
//! |---|---|---|
//! | MP4, QuickTime | [`mp4::Movie`] | [`mp4::Writer`] (fragmented, H.264) |
//! | AVI with OpenDML | [`avi::AviReader`] | – |
//! | Y4M | [`y4m::Y4mReader`] | – |
//! | Motion JPEG without a container | [`mjpeg::next_image`] | – |
//!
//! # Limits
//! Outside bytes are not trusted. Sizes and counts are checked against [`limits`] and against the bytes that are really
//! there before anything is allocated; a file whose end is missing gives what it still has.

pub mod avi;
pub mod bytes;
mod error;
pub mod limits;
pub mod mjpeg;
pub mod mp4;
mod storage;
pub mod y4m;

pub use error::ContainerError;
pub use storage::Storage;

/// The result of a fallible step.
pub type Result<T, E = ContainerError> = std::result::Result<T, E>;
