//! Time of an update, on the wall and on the processor.

use pursuit_tracking::many::{Clock, Reading};
use std::time::{Duration, Instant};

/// Knows time on the wall and the processor time of the calling thread; on systems that do not tell, time on the wall.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ThreadClock {
    origin: Instant,
}

impl Default for ThreadClock {
    fn default() -> Self {
        Self { origin: Instant::now() }
    }
}

impl Clock for ThreadClock {
    fn now(&self) -> Reading {
        let wall = self.origin.elapsed();
        Reading { wall, thread: thread_time().unwrap_or(wall) }
    }
}

#[cfg(unix)]
fn thread_time() -> Option<Duration> {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    Some(Duration::new(u64::try_from(time.tv_sec).ok()?, u32::try_from(time.tv_nsec).ok()?))
}

#[cfg(not(unix))]
fn thread_time() -> Option<Duration> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_tracking::many::Elapsed;

    #[test]
    fn sleeping_takes_time_on_the_wall_only() {
        let clock = ThreadClock::default();
        let ((), elapsed) = Elapsed::of(&clock, || std::thread::sleep(Duration::from_millis(20)));
        assert!(elapsed.wall_ms >= 20.0);
        assert!(elapsed.thread_ms <= elapsed.wall_ms);
    }
}
