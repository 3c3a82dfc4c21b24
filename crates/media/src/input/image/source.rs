use super::{decode_image, read_bounded};
use crate::input::fault::Fault;
use crate::{Result, Source, SourceInfo};
use pursuit_imaging::{Frame, Pixels};
use std::path::Path;

/// One still image as a video of one frame.
pub(crate) struct ImageSource {
    info: SourceInfo,
    frame: Option<Frame>,
}

impl ImageSource {
    pub fn open(path: &Path, name: &str) -> Result<Self, Fault> {
        let bytes = read_bounded(path)?;
        Ok(Self::new(decode_image(&bytes)?, name))
    }

    pub fn new(pixels: Pixels, name: &str) -> Self {
        let frame = Frame::new(0, 0.0, pixels);
        let info = SourceInfo::new(name, frame.size(), "still image (built in)");
        let info = SourceInfo { frame_count: Some(1), ..info };
        Self { info, frame: Some(frame) }
    }
}

impl Source for ImageSource {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_frame(&mut self) -> Result<Option<Frame>> {
        Ok(self.frame.take())
    }
}
