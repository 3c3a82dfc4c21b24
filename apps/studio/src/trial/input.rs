use pursuit::media::wrappers::{Prefetch, Trimmed};
use pursuit::media::{Locator, OpenOptions, Source, SourceInfo};
use pursuit::{RunError, open_with};

/// Frames decoded ahead of the tracker; fewer of large pictures.
const AHEAD_FRAMES: usize = 8;
const AHEAD_BYTES: usize = 40 << 20;
const BYTES_A_PIXEL: usize = 2;

/// An input that can be opened again, from any frame on where it is not live.
#[derive(Debug, Clone)]
pub(crate) struct Input {
    locator: Locator,
    options: OpenOptions,
}

impl Input {
    pub const fn new(locator: Locator, options: OpenOptions) -> Self {
        Self { locator, options }
    }

    /// Its frames from number `from` on, and what is known of the whole.
    ///
    /// # Errors
    /// An input that cannot be read, or has no such frame.
    pub fn open(&self, from: u64) -> Result<(Box<dyn Source>, SourceInfo), RunError> {
        let mut source = open_with(self.locator.clone(), &self.options)?;
        let info = source.info().clone();
        if from > 0 {
            if source.is_seekable() {
                source.seek(from)?;
            } else {
                source = Box::new(Trimmed::new(source, from, None)?);
            }
        }
        let ahead = (AHEAD_BYTES / (BYTES_A_PIXEL * info.size.area()).max(1)).clamp(2, AHEAD_FRAMES);
        Ok((Box::new(Prefetch::new(source, ahead)?), info))
    }
}
