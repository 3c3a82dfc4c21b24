use crate::Result;
use pursuit_imaging::{ImageView, Rgb8};
use std::path::Path;

/// Takes pictures one after the other and makes a video of them.
pub trait VideoWriter: Send {
    /// Adds a picture, shown from `time_s` on until the next one's time. Times count from the first; one that is not later
    /// than its predecessor is taken as later by the smallest step.
    ///
    /// # Errors
    /// [`MediaError::Unwritable`](crate::MediaError::Unwritable) when the picture cannot be encoded (its size changed, or
    /// is beyond the encoder's) or written. What was written before stays playable; later calls fail alike.
    fn write(&mut self, image: ImageView<'_, Rgb8>, time_s: f64) -> Result<()>;

    /// Writes what is still held back and the index. Later calls do nothing.
    ///
    /// # Errors
    /// As [`write`](Self::write).
    fn finish(&mut self) -> Result<()>;

    /// The file written.
    fn path(&self) -> &Path;
}

/// How a video is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VideoOptions {
    /// Frames per second, about: how long the last picture of a very short video is shown, and what the stream declares.
    /// Shown times are those of the frames.
    pub nominal_fps: f64,
    /// Width against height of a pixel, where they are not square.
    pub pixel_aspect: Option<(u32, u32)>,
}

impl Default for VideoOptions {
    fn default() -> Self {
        Self { nominal_fps: 30.0, pixel_aspect: None }
    }
}

impl VideoOptions {
    /// The nominal rate, 30 where it is none.
    #[cfg(feature = "encode")]
    pub(crate) fn sane_fps(&self) -> f64 {
        if self.nominal_fps > 0.0 && self.nominal_fps.is_finite() { self.nominal_fps.clamp(1.0, 240.0) } else { 30.0 }
    }
}
