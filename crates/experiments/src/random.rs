//! Random numbers of the experiments: one generator a seed and experiment, so that runs can go on any thread.

use rand_core::Rng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

/// Normal and uniform numbers from a PCG generator.
#[derive(Debug, Clone)]
pub(crate) struct Random(Pcg64);

impl Random {
    /// The generator of one run: `stream` tells experiments apart, `seed` their runs.
    pub fn new(stream: u64, seed: u64) -> Self {
        Self(Pcg64::new(u128::from(seed), u128::from(stream)))
    }

    /// Uniform in `[low, high)`.
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Standard normal.
    pub fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }

    /// One of −1 and 1.
    pub fn sign(&mut self) -> f64 {
        if self.0.next_u64() & 1 == 0 { 1.0 } else { -1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_numbers_have_normal_moments() {
        let mut random = Random::new(1, 2);
        let values: Vec<f64> = (0..40_000).map(|_| random.normal()).collect();
        let moment = |p: i32| values.iter().map(|v| v.powi(p)).sum::<f64>() / values.len() as f64;
        assert!(moment(1).abs() < 0.02 && (moment(2) - 1.0).abs() < 0.03 && (moment(4) - 3.0).abs() < 0.2);
    }

    #[test]
    fn seeds_and_streams_are_apart_and_repeat() {
        let first = |stream, seed| Random::new(stream, seed).normal();
        assert_eq!(first(1, 1), first(1, 1));
        assert_ne!(first(1, 1), first(1, 2));
        assert_ne!(first(1, 1), first(2, 1));
    }
}
