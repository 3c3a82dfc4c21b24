//! Time of an update, on the wall and on the processor.

use std::time::{Duration, Instant};

/// Both times of one call.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Elapsed {
    /// Time on the wall.
    pub wall: Duration,
    /// Processor time of this thread; on systems that do not tell, time on the wall.
    pub thread: Duration,
}

/// Runs `work` and says how long it took.
pub(crate) fn timed<T>(work: impl FnOnce() -> T) -> (T, Elapsed) {
    let (wall, thread) = (Instant::now(), thread_time());
    let result = work();
    let after = thread_time();
    let wall = wall.elapsed();
    let thread = match (thread, after) {
        (Some(before), Some(after)) => after.saturating_sub(before),
        _ => wall,
    };
    (result, Elapsed { wall, thread })
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

    #[test]
    fn sleeping_takes_time_on_the_wall_only() {
        let ((), elapsed) = timed(|| std::thread::sleep(Duration::from_millis(20)));
        assert!(elapsed.wall >= Duration::from_millis(20));
        assert!(elapsed.thread <= elapsed.wall);
    }
}
