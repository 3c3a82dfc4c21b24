use std::time::Duration;

/// For how long a live source that has gone silent or broken off is connected to again.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Reconnect {
    /// Not at all: the first trouble ends it.
    Never,
    /// Until this long after the trouble began.
    For(Duration),
    /// Until it is stopped.
    #[default]
    Forever,
}

impl Reconnect {
    /// Whether to go on `since` the trouble began.
    pub fn allows(self, since: Duration) -> bool {
        match self {
            Self::Never => false,
            Self::For(limit) => since < limit,
            Self::Forever => true,
        }
    }
}

/// The wait before the first attempt; each further one is twice as long.
const FIRST_WAIT: Duration = Duration::from_millis(250);
/// The longest wait: a camera that is back is seen again within it.
const LONGEST_WAIT: Duration = Duration::from_secs(10);

/// How long to wait before attempt `number`, from 0.
pub(super) fn wait_before(number: u32) -> Duration {
    FIRST_WAIT.saturating_mul(1_u32.checked_shl(number).unwrap_or(u32::MAX)).min(LONGEST_WAIT)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waits_double_up_to_ten_seconds() {
        let waits: Vec<u128> = (0..8).map(|n| wait_before(n).as_millis()).collect();
        assert_eq!(waits, [250, 500, 1000, 2000, 4000, 8000, 10_000, 10_000]);
        assert_eq!(wait_before(31), LONGEST_WAIT);
        assert_eq!(wait_before(99), LONGEST_WAIT);
    }

    #[test]
    fn it_goes_on_as_long_as_was_asked_for() {
        let second = Duration::from_secs(1);
        assert!(!Reconnect::Never.allows(Duration::ZERO));
        assert!(Reconnect::For(second).allows(Duration::ZERO) && !Reconnect::For(second).allows(second));
        assert!(Reconnect::Forever.allows(Duration::from_secs(1 << 40)));
    }
}
