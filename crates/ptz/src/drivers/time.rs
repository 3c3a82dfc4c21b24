use crate::Result;
use crate::error::require;
use std::time::Duration;

/// For how long a driver waits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Timeouts {
    /// For a connection.
    pub connect: Duration,
    /// For a whole answer to a command, however slowly it trickles in.
    pub answer: Duration,
}

impl Default for Timeouts {
    fn default() -> Self {
        Self { connect: Duration::from_secs(3), answer: Duration::from_secs(1) }
    }
}

impl Timeouts {
    /// Waits of these many seconds.
    ///
    /// # Errors
    /// Unless both are in [0.01, 60].
    pub fn from_secs(connect_s: f64, answer_s: f64) -> Result<Self> {
        let sound = |name, value: f64| require(name, value, (0.01..=60.0).contains(&value), "between 0.01 and 60 s");
        sound("connect_s", connect_s)?;
        sound("answer_s", answer_s)?;
        Ok(Self { connect: Duration::from_secs_f64(connect_s), answer: Duration::from_secs_f64(answer_s) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waits_are_bounded() {
        let waits = Timeouts::from_secs(2.0, 0.25).unwrap();
        assert_eq!((waits.connect, waits.answer), (Duration::from_secs(2), Duration::from_millis(250)));
        for (connect, answer) in [(0.0, 1.0), (1.0, 61.0), (f64::NAN, 1.0), (1.0, f64::INFINITY)] {
            assert!(Timeouts::from_secs(connect, answer).is_err());
        }
    }
}
