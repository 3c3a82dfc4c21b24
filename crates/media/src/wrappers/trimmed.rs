use crate::input::StopHandle;
use crate::{MediaError, Result, Source, SourceInfo};
use pursuit_imaging::Frame;

/// A part of a video, by frame number, both ends included. Frames keep their numbers and times.
///
/// Frames before the part are decoded and thrown away: video cannot be entered anywhere.
pub struct Trimmed<S> {
    source: S,
    info: SourceInfo,
    from: u64,
    to: u64,
    finished: bool,
}

impl<S: Source> Trimmed<S> {
    /// Frames `from` to `to`; without `to`, all from `from` on.
    ///
    /// # Errors
    /// [`MediaError::Unreadable`] when the part is known to be empty.
    pub fn new(source: S, from: u64, to: Option<u64>) -> Result<Self> {
        let to = to.unwrap_or(u64::MAX);
        // How long the whole is says nothing of a part.
        let mut info = SourceInfo { duration_s: None, ..source.info().clone() };
        if from > to {
            let reason = format!("frames {from} to {to} are none; the first must not come after the last");
            return Err(MediaError::unreadable(&info.name, reason));
        }
        if let Some(count) = info.frame_count {
            if from >= count {
                let reason = format!("it has {count} frames, so there is no frame {from}; frames count from 0");
                return Err(MediaError::unreadable(&info.name, reason));
            }
            info.frame_count = Some(count.min(to.saturating_add(1)) - from);
        }
        Ok(Self { source, info, from, to, finished: false })
    }
}

impl<S: Source> Source for Trimmed<S> {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_frame(&mut self) -> Result<Option<Frame>> {
        while !self.finished {
            let frame = self.source.next_frame()?;
            self.finished = frame.as_ref().is_none_or(|f| f.index() >= self.to);
            if let Some(frame) = frame.filter(|f| (self.from..=self.to).contains(&f.index())) {
                return Ok(Some(frame));
            }
        }
        Ok(None)
    }

    fn seek(&mut self, index: u64) -> Result<()> {
        if !(self.from..=self.to).contains(&index) {
            let reason = format!("only frames from {} to {} were asked for", self.from, self.to);
            return Err(MediaError::not_seekable(&self.info.name, index, reason));
        }
        self.source.seek(index)?;
        self.finished = false;
        Ok(())
    }

    fn stop_handle(&self) -> Option<StopHandle> {
        self.source.stop_handle()
    }
}
