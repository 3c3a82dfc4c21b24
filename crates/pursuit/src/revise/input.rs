use crate::{RunError, open_with};
use pursuit_media::wrappers::{Prefetch, Trimmed};
use pursuit_media::{Locator, OpenOptions, Source, SourceInfo};

/// Frames decoded ahead of the tracker; fewer of large pictures.
const AHEAD_FRAMES: usize = 8;
const AHEAD_BYTES: usize = 40 << 20;
const BYTES_A_PIXEL: usize = 2;

/// An input that can be opened again, from any frame on where it is not live.
#[derive(Debug, Clone)]
pub struct Input {
    locator: Locator,
    options: OpenOptions,
}

impl Input {
    /// Named as [`open`](crate::open) takes it; nothing is opened yet.
    pub fn new(locator: impl Into<Locator>, options: OpenOptions) -> Self {
        Self { locator: locator.into(), options }
    }

    /// Its frames from number `from` on, and what is known of the whole.
    ///
    /// # Errors
    /// An input that cannot be read, or has no such frame.
    pub fn open(&self, from: u64) -> Result<(Box<dyn Source>, SourceInfo), RunError> {
        let mut source = open_with(self.locator.clone(), &self.options)?;
        let info = source.info().clone();
        if from > 0 {
            if source.info().seekable {
                source.seek(from)?;
            } else {
                source = Box::new(Trimmed::new(source, from, None)?);
            }
        }
        let ahead = (AHEAD_BYTES / (BYTES_A_PIXEL * info.size.area()).max(1)).clamp(2, AHEAD_FRAMES);
        Ok((Box::new(Prefetch::new(source, ahead)?), info))
    }
}
