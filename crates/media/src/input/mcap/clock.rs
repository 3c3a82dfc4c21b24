//! When the pictures of a recording were taken.

/// Makes times of frames of what the images say, or of when they were recorded.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Clock {
    /// Whether the images say when they were taken.
    by_stamp: bool,
    /// What counts as zero, in nanoseconds.
    first_ns: i64,
    /// The time of the last frame, and when that was recorded.
    last_ns: Option<(i64, i64)>,
}

impl Clock {
    /// The least step of time: stamps that stand still or go back are no times.
    const LEAST_NS: i64 = 100_000;
    /// A stamp is no time either if it leaps by so much more than the recorder's clock, as where a clock was set.
    const LEAP_NS: i64 = 60_000_000_000;

    /// The time of the next frame in seconds from the first, by its stamp and by when it was recorded.
    pub fn time_s(&mut self, stamp_ns: i64, logged_ns: i64) -> f64 {
        let time_ns = match self.last_ns {
            None => {
                self.by_stamp = stamp_ns > 0;
                self.first_ns = if self.by_stamp { stamp_ns } else { logged_ns };
                0
            }
            Some((last_ns, last_logged_ns)) => {
                let logged_step = logged_ns.saturating_sub(last_logged_ns).max(Self::LEAST_NS);
                let said = if self.by_stamp { stamp_ns } else { logged_ns };
                let time_ns = said.saturating_sub(self.first_ns);
                let longest = logged_step.saturating_add(Self::LEAP_NS);
                if (1..=longest).contains(&time_ns.saturating_sub(last_ns)) {
                    time_ns
                } else {
                    last_ns.saturating_add(logged_step)
                }
            }
        };
        self.last_ns = Some((time_ns, logged_ns));
        // Of whole numbers the quotient is the nearest that there is: frame 3 of 25 a second comes at 0.12 s exactly.
        time_ns as f64 / 1e9
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn times(pairs: &[(f64, f64)]) -> Vec<f64> {
        let mut clock = Clock::default();
        let nanoseconds = |seconds: f64| (seconds * 1e9).round() as i64;
        pairs.iter().map(|(stamp, logged)| clock.time_s(nanoseconds(*stamp), nanoseconds(*logged))).collect()
    }

    #[test]
    fn stamps_are_times_as_long_as_they_grow() {
        assert_eq!(times(&[(1.7e9, 7.0), (1.7e9 + 0.04, 7.9), (1.7e9 + 0.12, 8.0)]), [0.0, 0.04, 0.12]);
        assert_eq!(times(&[(0.0, 7.0), (0.0, 7.5)]), [0.0, 0.5], "no stamps");
        assert_eq!(times(&[(100.0, 7.0), (100.0, 7.5), (102.0, 8.0)]), [0.0, 0.5, 2.0], "a stamp that stands still");
        assert_eq!(times(&[(100.0, 7.0), (99.0, 7.0)]), [0.0, 1e-4], "both clocks do not go on");
    }

    #[test]
    fn a_clock_that_was_set_is_no_gap() {
        assert_eq!(times(&[(5.0, 7.0), (1.7e9, 7.5), (1.7e9 + 0.5, 8.0)]), [0.0, 0.5, 1.0]);
        assert_eq!(times(&[(5.0, 7.0), (605.0, 607.0)]), [0.0, 600.0], "both say that there was a gap");
    }

    proptest! {
        #[test]
        fn times_always_grow(pairs in prop::collection::vec((any::<i64>(), any::<u64>()), 2..20)) {
            let mut clock = Clock::default();
            let logged = |ns: u64| i64::try_from(ns).unwrap_or(i64::MAX);
            let times: Vec<f64> = pairs.iter().map(|(stamp, ns)| clock.time_s(*stamp, logged(*ns))).collect();
            prop_assert!(times.windows(2).all(|pair| pair[0] <= pair[1]), "{times:?}");
        }
    }
}
