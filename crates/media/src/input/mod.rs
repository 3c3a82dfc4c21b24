//! Where frames come from.
//!
//! [`open`] looks at what an input *is* (its first bytes, not its name) and returns a [`Source`]. H.264 in MP4/MOV,
//! Motion JPEG in AVI, Y4M, and JPEG and PNG images are decoded here, with nothing installed; every other container,
//! codec, stream and camera goes through an `ffmpeg` process.
//!
//! # Limits
//! Outside bytes are not trusted. An image side is at most 32 768 pixels, an image at most [`MAX_PIXELS`]; both are checked
//! from headers before anything is allocated. Files are read piece by piece, so that memory does not grow with a clip's
//! length beyond 24 bytes a frame of an MP4's index.

pub(crate) mod annotations;
pub(crate) mod avi;
mod cancel;
mod color;
#[cfg(feature = "h264")]
mod fallback;
pub(crate) mod fault;
mod ffmpeg;
pub(crate) mod folder;
mod frames;
#[cfg(feature = "h264")]
mod h264;
pub(crate) mod image;
mod limits;
#[cfg(feature = "mcap")]
mod mcap;
pub(crate) mod mjpeg;
#[cfg(feature = "h264")]
pub(crate) mod mp4;
mod open;
mod options;
#[cfg(feature = "h264")]
mod orientation;
mod rgbd;
#[cfg(feature = "rtsp")]
mod rtsp;
mod sniff;
mod source;
mod streams;
mod view;
pub(crate) mod y4m;

pub use cancel::Cancel;
pub(crate) use cancel::open_within;
pub use frames::Frames;
pub use image::{Labels, read_labels};
pub use limits::MAX_PIXELS;
pub use open::{open, open_stream};
pub use options::OpenOptions;
pub use pursuit_address::Locator;
pub use pursuit_geometry::Truth;
pub use rgbd::{open_with_depth, with_depth};
pub use source::{Source, SourceInfo, StopHandle};
pub use view::View;
