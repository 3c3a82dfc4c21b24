//! How long each target's work took, told by a clock that callers may choose.

use std::time::{Duration, Instant};

/// Two clocks read at once, each from an origin of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Reading {
    /// Time on the wall.
    pub wall: Duration,
    /// Processor time of the calling thread; time on the wall where that cannot be told.
    pub thread: Duration,
}

/// What the time of a target's work is taken with.
pub trait Clock: Send + Sync {
    /// The clocks now.
    fn now(&self) -> Reading;
}

/// How long something took, in milliseconds.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Elapsed {
    /// On the wall.
    pub wall_ms: f64,
    /// On the processor, by the thread that did it; as on the wall where the clock cannot tell.
    pub thread_ms: f64,
}

impl Elapsed {
    /// Does `work` and takes the time.
    pub fn of<T>(clock: &dyn Clock, work: impl FnOnce() -> T) -> (T, Self) {
        let before = clock.now();
        let result = work();
        let after = clock.now();
        let ms = |before: Duration, after: Duration| after.saturating_sub(before).as_secs_f64() * 1e3;
        (result, Self { wall_ms: ms(before.wall, after.wall), thread_ms: ms(before.thread, after.thread) })
    }

    /// The part of each where `count` took that long together.
    pub(super) fn shared_by(self, count: usize) -> Self {
        let count = count.max(1) as f64;
        Self { wall_ms: self.wall_ms / count, thread_ms: self.thread_ms / count }
    }
}

/// Knows time on the wall alone.
#[derive(Debug, Clone, Copy)]
pub struct WallClock {
    origin: Instant,
}

impl Default for WallClock {
    fn default() -> Self {
        Self { origin: Instant::now() }
    }
}

impl Clock for WallClock {
    fn now(&self) -> Reading {
        let wall = self.origin.elapsed();
        Reading { wall, thread: wall }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicU64, Ordering};

    /// Goes on by 3 ms on the wall and 2 ms on the processor whenever it is read.
    #[derive(Default)]
    struct Counting(AtomicU64);

    impl Clock for Counting {
        fn now(&self) -> Reading {
            let n = self.0.fetch_add(1, Ordering::Relaxed);
            Reading { wall: Duration::from_millis(3 * n), thread: Duration::from_millis(2 * n) }
        }
    }

    #[test]
    fn both_times_are_taken_around_the_work() {
        let clock = Counting::default();
        let (answer, elapsed) = Elapsed::of(&clock, || {
            clock.now();
            7
        });
        assert_eq!((answer, elapsed), (7, Elapsed { wall_ms: 6.0, thread_ms: 4.0 }));
    }

    #[test]
    fn the_wall_clock_goes_on() {
        let clock = WallClock::default();
        let ((), elapsed) = Elapsed::of(&clock, || std::thread::sleep(Duration::from_millis(5)));
        assert!(elapsed.wall_ms >= 5.0 && elapsed.thread_ms == elapsed.wall_ms);
    }
}
