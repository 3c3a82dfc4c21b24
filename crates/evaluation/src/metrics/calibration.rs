//! Is `score` what it says: the probability that the box overlaps the target by at least one half?
//!
//! Expected calibration error with equal-width bins (Naeini, Cooper, Hauskrecht 2015; Guo et al. 2017, eq. 3).

use serde::{Deserialize, Serialize};

/// Bins of the reliability diagram.
pub const BINS: usize = 10;

/// A score that was given, and whether it came true.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Forecast {
    /// The probability given, in `[0, 1]`.
    pub score: f64,
    /// Whether the box overlapped the target by at least one half.
    pub hit: bool,
}

/// One bar of the reliability diagram: scores from `i / BINS` on.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Bin {
    /// Frames in it.
    pub frames: usize,
    /// Mean score of these frames.
    pub mean_score: f64,
    /// Fraction of them that came true.
    pub hit_rate: f64,
}

/// The reliability diagram: equal-width bins over `[0, 1]`, the last one closed.
pub fn reliability(forecasts: &[Forecast]) -> [Bin; BINS] {
    let mut sums = [(0usize, 0.0, 0usize); BINS];
    for f in forecasts {
        let score = if f.score.is_finite() { f.score.clamp(0.0, 1.0) } else { 0.0 };
        let bin = ((score * BINS as f64) as usize).min(BINS - 1);
        let (frames, scores, hits) = &mut sums[bin];
        *frames += 1;
        *scores += score;
        *hits += usize::from(f.hit);
    }
    sums.map(|(frames, scores, hits)| {
        let n = frames.max(1) as f64;
        Bin { frames, mean_score: scores / n, hit_rate: hits as f64 / n }
    })
}

/// Σ (frames in bin / frames) · |hit rate − mean score|; `None` without frames.
pub fn expected_calibration_error(bins: &[Bin]) -> Option<f64> {
    let frames: usize = bins.iter().map(|b| b.frames).sum();
    let gap = |b: &Bin| b.frames as f64 / frames as f64 * (b.hit_rate - b.mean_score).abs();
    (frames > 0).then(|| bins.iter().map(gap).sum())
}
