//! Where frames and results go to: drawing, video and still pictures.
//!
//! ```no_run
//! use pursuit_media::output::{Canvas, Mp4Writer, Stroke, VideoOptions, VideoWriter};
//! # let (frame, bbox): (pursuit_imaging::Frame, pursuit_geometry::BBox) = todo!();
//! let mut video = Mp4Writer::create("overlay.mp4".as_ref(), VideoOptions::default())?;
//! let mut canvas = Canvas::new(frame.color().to_image());
//! canvas.rectangle(&bbox, &Stroke::new([0, 255, 0], 2.0 * canvas.scale()));
//! video.write(canvas.image().view(), frame.time_s())?;
//! video.finish()?;
//! # Ok::<(), pursuit_media::MediaError>(())
//! ```

mod canvas;
#[cfg(feature = "encode")]
mod clips;
#[cfg(feature = "encode")]
mod h264;
#[cfg(feature = "encode")]
mod i420;
#[cfg(feature = "encode")]
mod mp4;
mod still;
mod text;
mod video;
mod wire;

pub use canvas::{Canvas, Stroke};
#[cfg(feature = "encode")]
pub use clips::ClipRecorder;
#[cfg(feature = "encode")]
pub use mp4::Mp4Writer;
pub use pursuit_containers::Storage;
pub use still::{encode_jpeg, write_jpeg, write_png};
pub use video::{VideoOptions, VideoWriter};
pub use wire::{WireEncoder, WirePicture, h264_for_wire};
