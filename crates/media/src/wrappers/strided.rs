use crate::input::StopHandle;
use crate::{Result, Source, SourceInfo};
use pursuit_imaging::Frame;
use std::num::NonZeroU64;

/// Every so many frames one, from the first on. Frames keep their numbers and times.
pub struct Strided<S> {
    source: S,
    info: SourceInfo,
    stride: u64,
    /// The number of the next frame wanted; none before the first.
    due: Option<u64>,
}

impl<S: Source> Strided<S> {
    /// One of `stride` frames of `source`.
    pub fn new(source: S, stride: NonZeroU64) -> Self {
        let (stride, info) = (stride.get(), source.info());
        let frame_count = info.frame_count.map(|count| count.div_ceil(stride));
        let info = SourceInfo { fps: info.fps.map(|fps| fps / stride as f64), frame_count, ..info.clone() };
        Self { source, info, stride, due: None }
    }
}

impl<S: Source> Source for Strided<S> {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_frame(&mut self) -> Result<Option<Frame>> {
        while let Some(frame) = self.source.next_frame()? {
            let due = *self.due.get_or_insert(frame.index());
            if frame.index() >= due {
                // What was due and could not be had is made up for by the next there is.
                let passed = (frame.index() - due) / self.stride + 1;
                self.due = Some(due.saturating_add(passed.saturating_mul(self.stride)));
                return Ok(Some(frame));
            }
        }
        Ok(None)
    }

    fn seek(&mut self, index: u64) -> Result<()> {
        self.source.seek(index)?;
        self.due = Some(index);
        Ok(())
    }

    fn stop_handle(&self) -> Option<StopHandle> {
        self.source.stop_handle()
    }
}
