use super::StopHandle;
use crate::{MediaError, Result, Source, SourceInfo};
use pursuit_imaging::Frame;

/// Frames that a program has, or makes as they are asked for. They carry their own numbers and times.
pub struct Frames<I> {
    info: SourceInfo,
    first: Option<Frame>,
    frames: I,
    stop: Option<StopHandle>,
    finished: bool,
}

impl<I: Iterator<Item = Result<Frame>> + Send> Frames<I> {
    /// The frames of an iterator, under the name `name`. The first is taken at once: it says the size.
    ///
    /// # Errors
    /// [`MediaError::Unreadable`] when there is none, or the error that comes in its place.
    pub fn new(name: &str, frames: impl IntoIterator<IntoIter = I>) -> Result<Self> {
        let mut frames = frames.into_iter();
        let (least, most) = frames.size_hint();
        let first = frames.next().transpose()?.ok_or_else(|| MediaError::unreadable(name, "it has no frames"))?;
        let frame_count = most.filter(|most| *most == least).map(|count| count as u64);
        let info = SourceInfo { frame_count, ..SourceInfo::new(name, first.size(), "frames of the program") };
        Ok(Self { info, first: Some(first), frames, stop: None, finished: false })
    }

    /// What is known of them, to be completed by whoever knows more, such as their rate.
    pub const fn info_mut(&mut self) -> &mut SourceInfo {
        &mut self.info
    }

    /// The same; `stop` ends a wait for a frame that may never come.
    #[must_use]
    pub fn stopped_by(self, stop: StopHandle) -> Self {
        Self { stop: Some(stop), ..self }
    }
}

impl<I: Iterator<Item = Result<Frame>> + Send> Source for Frames<I> {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_frame(&mut self) -> Result<Option<Frame>> {
        if self.finished {
            return Ok(None);
        }
        let frame = self.first.take().map(Ok).or_else(|| self.frames.next()).transpose();
        self.finished = matches!(frame, Ok(None)) || frame.as_ref().is_err_and(|e| !e.is_damage());
        frame
    }

    fn stop_handle(&self) -> Option<StopHandle> {
        self.stop.clone()
    }
}
