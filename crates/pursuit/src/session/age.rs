use crate::run::{Timing, TimingSummary};

/// How old the frames of a live source are when they are taken up. Nobody says when a picture was taken by our clock; the
/// frame that came soonest after its own time stands for no age at all.
#[derive(Debug, Default)]
pub(super) struct Age {
    /// The least time, seconds, between a frame's own time and its being taken up.
    least_s: Option<f64>,
    ages: Timing,
}

impl Age {
    /// A frame of the time `time_s` is taken up at `now_s`: how old it is, milliseconds.
    pub fn take(&mut self, now_s: f64, time_s: f64) -> f64 {
        let late_s = now_s - time_s;
        let least_s = self.least_s.map_or(late_s, |least_s| least_s.min(late_s));
        self.least_s = Some(least_s);
        let age_ms = 1e3 * (late_s - least_s);
        self.ages.add(age_ms);
        age_ms
    }

    pub fn summary(&self) -> TimingSummary {
        self.ages.summary()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_promptest_frame_has_no_age() {
        let mut age = Age::default();
        assert_eq!(age.summary(), TimingSummary::default());
        for (now_s, time_s) in [(5.0, 0.0), (5.1, 0.1), (5.7, 0.2), (5.25, 0.3)] {
            age.take(now_s, time_s);
        }
        let summary = age.summary();
        assert_eq!(summary.count, 4);
        assert!((summary.max - 500.0).abs() < 1e-6 && (summary.mean - 125.0).abs() < 1e-6, "{summary:?}");
    }
}
