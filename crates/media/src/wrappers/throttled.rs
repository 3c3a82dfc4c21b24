use crate::input::StopHandle;
use crate::{MediaError, Result, Source, SourceInfo};
use pursuit_imaging::Frame;
use std::time::{Duration, Instant};

/// Delivers frames no earlier than their times say, as a camera would.
pub struct Throttled<S> {
    source: S,
    info: SourceInfo,
    speed: f64,
    /// When the first frame was delivered, and its time in seconds.
    start: Option<(Instant, f64)>,
}

impl<S: Source> Throttled<S> {
    /// Plays `source` at `speed` times real time; a speed that is no positive number plays in real time.
    pub fn new(source: S, speed: f64) -> Self {
        let speed = if speed.is_finite() && speed > 0.0 { speed } else { 1.0 };
        Self { info: source.info().clone(), source, speed, start: None }
    }

    /// Plays `source` in real time and says that it is live: who is too slow misses frames.
    pub fn as_camera(source: S) -> Self {
        let throttled = Self::new(source, 1.0);
        Self { info: SourceInfo { live: true, seekable: false, ..throttled.info }, ..throttled }
    }
}

impl<S: Source> Source for Throttled<S> {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_frame(&mut self) -> Result<Option<Frame>> {
        let frame = self.source.next_frame()?;
        if let Some(frame) = &frame {
            let (start, first_s) = *self.start.get_or_insert((Instant::now(), frame.time_s()));
            let due_s = (frame.time_s() - first_s) / self.speed;
            // A time that jumps backwards or absurdly far is not waited for.
            let due = Duration::try_from_secs_f64(due_s).ok().and_then(|d| start.checked_add(d));
            std::thread::sleep(due.map_or(Duration::ZERO, |due| due.saturating_duration_since(Instant::now())));
        }
        Ok(frame)
    }

    /// Real time begins anew at that frame.
    fn seek(&mut self, index: u64) -> Result<()> {
        if self.info.live {
            return Err(MediaError::not_seekable(&self.info.name, index, "it is played as a camera would"));
        }
        self.source.seek(index)?;
        self.start = None;
        Ok(())
    }

    fn stop_handle(&self) -> Option<StopHandle> {
        self.source.stop_handle()
    }
}
