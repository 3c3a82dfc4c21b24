use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// How long to wait between attempts: twice as long each time, up to a limit, a little different for everyone so that a
/// whole fleet does not come back at once.
#[derive(Debug)]
pub(crate) struct BackOff {
    next: Duration,
}

impl BackOff {
    const FIRST: Duration = Duration::from_millis(250);
    const LONGEST: Duration = Duration::from_secs(15);

    pub const fn new() -> Self {
        Self { next: Self::FIRST }
    }

    /// How long to wait this time.
    pub fn wait(&mut self) -> Duration {
        let nanoseconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.subsec_nanos());
        self.wait_with(f64::from(nanoseconds % 1_000_000) * 1e-6)
    }

    /// The same with a part in `[0, 1)` left to chance.
    fn wait_with(&mut self, chance: f64) -> Duration {
        let wait = self.next.mul_f64(0.75 + 0.25 * chance);
        self.next = (2 * self.next).min(Self::LONGEST);
        wait
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waits_grow_up_to_a_limit() {
        let mut waits = BackOff::new();
        let all: Vec<Duration> = (0..20).map(|_| waits.wait_with(0.0)).collect();
        assert_eq!(all[0], BackOff::FIRST.mul_f64(0.75));
        assert!(all.windows(2).all(|w| w[0] <= w[1]));
        assert_eq!(*all.last().unwrap(), BackOff::LONGEST.mul_f64(0.75));
        assert!(waits.wait() <= BackOff::LONGEST);
    }
}
