use crate::input::StopHandle;
use crate::{Result, Source, SourceInfo};
use pursuit_imaging::Frame;
use std::time::{Duration, Instant};

/// Delivers frames no earlier than their times say, as a camera would.
pub struct Throttled<S> {
    source: S,
    speed: f64,
    /// When the first frame was delivered, and its time in seconds.
    start: Option<(Instant, f64)>,
}

impl<S: Source> Throttled<S> {
    /// Plays `source` at `speed` times real time; a speed that is no positive number plays in real time.
    pub fn new(source: S, speed: f64) -> Self {
        let speed = if speed.is_finite() && speed > 0.0 { speed } else { 1.0 };
        Self { source, speed, start: None }
    }
}

impl<S: Source> Source for Throttled<S> {
    fn info(&self) -> &SourceInfo {
        self.source.info()
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
        self.source.seek(index)?;
        self.start = None;
        Ok(())
    }

    fn stop_handle(&self) -> Option<StopHandle> {
        self.source.stop_handle()
    }
}
