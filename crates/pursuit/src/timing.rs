use serde::Serialize;

/// Durations in milliseconds, summarised in constant memory: a histogram whose bins are 2 % wide.
#[derive(Debug, Clone)]
pub struct Timing {
    bins: Vec<u64>,
    count: u64,
    sum_ms: f64,
    max_ms: f64,
}

/// Mean and quantiles of durations, in milliseconds; quantiles are good to 2 %.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct TimingSummary {
    /// How many there were.
    pub count: u64,
    /// Mean.
    pub mean: f64,
    /// Median.
    pub p50: f64,
    /// 95 % quantile.
    pub p95: f64,
    /// 99 % quantile.
    pub p99: f64,
    /// Longest.
    pub max: f64,
}

const SHORTEST_MS: f64 = 1e-4;
const BIN_RATIO: f64 = 1.02;
/// From 0.1 µs to about 11 days.
const BINS: usize = 1_500;

impl Default for Timing {
    fn default() -> Self {
        Self { bins: vec![0; BINS], count: 0, sum_ms: 0.0, max_ms: 0.0 }
    }
}

impl Timing {
    /// Adds a duration.
    pub fn add(&mut self, ms: f64) {
        let bin = ((ms / SHORTEST_MS).max(1.0).ln() / BIN_RATIO.ln()) as usize;
        self.bins[bin.min(BINS - 1)] += 1;
        self.count += 1;
        self.sum_ms += ms;
        self.max_ms = self.max_ms.max(ms);
    }

    /// Mean and quantiles; all zero when nothing was added.
    pub fn summary(&self) -> TimingSummary {
        if self.count == 0 {
            return TimingSummary::default();
        }
        TimingSummary {
            count: self.count,
            mean: self.sum_ms / self.count as f64,
            p50: self.quantile(0.50),
            p95: self.quantile(0.95),
            p99: self.quantile(0.99),
            max: self.max_ms,
        }
    }

    fn quantile(&self, q: f64) -> f64 {
        let wanted = (q * self.count as f64).ceil() as u64;
        let mut seen = 0;
        let bin = self.bins.iter().position(|&n| {
            seen += n;
            seen >= wanted
        });
        let middle = SHORTEST_MS * BIN_RATIO.powf(bin.unwrap_or(BINS - 1) as f64 + 0.5);
        middle.min(self.max_ms)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_agree_with_sorting_to_two_percent() {
        let mut timing = Timing::default();
        let mut all: Vec<f64> = (0..1000).map(|i| 0.01 * 1.01f64.powi((i * 37) % 1000)).collect();
        all.iter().for_each(|&ms| timing.add(ms));
        all.sort_by(f64::total_cmp);
        let s = timing.summary();
        for (got, want) in [(s.p50, all[499]), (s.p95, all[949]), (s.p99, all[989])] {
            assert!((got / want - 1.0).abs() < 0.02, "{got} {want}");
        }
        assert_eq!((s.count, s.max), (1000, all[999]));
        assert!((s.mean - all.iter().sum::<f64>() / 1000.0).abs() < 1e-9);
    }

    #[test]
    fn nothing_and_extremes_are_harmless() {
        let mut timing = Timing::default();
        assert_eq!(timing.summary(), TimingSummary::default());
        timing.add(0.0);
        timing.add(1e12);
        assert_eq!(timing.summary().max, 1e12);
    }
}
