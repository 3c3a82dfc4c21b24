use crate::input::StopHandle;
use crate::{MediaError, Result, Source, SourceInfo};
use pursuit_imaging::Frame;

/// Gives frames the times of a constant rate, whatever the input says: for inputs that state a wrong rate, or none.
pub struct Retimed<S> {
    source: S,
    info: SourceInfo,
    fps: f64,
}

impl<S: Source> Retimed<S> {
    /// Frame `n` gets the time `n / fps` seconds.
    ///
    /// # Errors
    /// [`MediaError::Unreadable`] unless `fps` is a positive number.
    pub fn new(source: S, fps: f64) -> Result<Self> {
        if !(fps.is_finite() && fps > 0.0) {
            let reason = format!("{fps} frames per second is no rate; give a number above zero");
            return Err(MediaError::unreadable(&source.info().name, reason));
        }
        let info = SourceInfo { fps: Some(fps), duration_s: None, ..source.info().clone() };
        Ok(Self { source, info, fps })
    }
}

impl<S: Source> Source for Retimed<S> {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_frame(&mut self) -> Result<Option<Frame>> {
        let frame = self.source.next_frame()?;
        Ok(frame.map(|frame| {
            let index = frame.index();
            frame.retimed(index, index as f64 / self.fps)
        }))
    }

    fn seek(&mut self, index: u64) -> Result<()> {
        self.source.seek(index)
    }

    fn stop_handle(&self) -> Option<StopHandle> {
        self.source.stop_handle()
    }
}
