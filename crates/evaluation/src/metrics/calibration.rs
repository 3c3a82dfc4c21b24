//! Calibration of `score`, the probability that the box overlaps the target by at least one half.
//!
//! Expected calibration error with equal-width bins (Naeini, Cooper, Hauskrecht 2015; Guo et al. 2017, eq. 3).

use serde::{Deserialize, Serialize};

/// Bins of the reliability diagram.
pub const BINS: usize = 10;

/// A score that was given, and whether it came true.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScoreForecast {
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
pub fn reliability(forecasts: &[ScoreForecast]) -> [Bin; BINS] {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn forecasts(of: &[(f64, bool)]) -> Vec<ScoreForecast> {
        of.iter().map(|&(score, hit)| ScoreForecast { score, hit }).collect()
    }

    #[test]
    fn bins_hold_means_and_hit_rates() {
        let bins = reliability(&forecasts(&[
            (0.0, false),
            (0.05, true),
            (0.099, false),
            (0.1, true), // the first of the next bin
            (0.72, true),
            (0.78, false),
            (1.0, true), // the last bin is closed
            (0.95, true),
        ]));
        let expect = |i: usize, frames: usize, mean_score: f64, hit_rate: f64| {
            let bin = bins[i];
            assert_eq!(bin.frames, frames, "bin {i}");
            assert!(
                (bin.mean_score - mean_score).abs() < 1e-12 && (bin.hit_rate - hit_rate).abs() < 1e-12,
                "{i} {bin:?}"
            );
        };
        expect(0, 3, 0.149 / 3.0, 1.0 / 3.0);
        expect(1, 1, 0.1, 1.0);
        expect(7, 2, 0.75, 0.5);
        expect(9, 2, 0.975, 1.0);
        [2, 3, 4, 5, 6, 8].into_iter().for_each(|i| expect(i, 0, 0.0, 0.0));
    }

    #[test]
    fn impossible_scores_are_clamped() {
        let bins = reliability(&forecasts(&[(-0.5, false), (7.0, true), (f64::NAN, true), (f64::INFINITY, true)]));
        assert_eq!((bins[0].frames, bins[9].frames), (3, 1), "what is not finite is no claim");
        assert_eq!((bins[0].mean_score, bins[9].mean_score), (0.0, 1.0));
        assert!((bins[0].hit_rate - 2.0 / 3.0).abs() < 1e-12);
    }

    #[test]
    fn calibration_error_weights_gaps_by_frames() {
        // Guo 2017, eq. 3: 1/4 · |0.25 - 0| + 3/4 · |0.75 - 2/3|, by hand.
        let bins = reliability(&forecasts(&[(0.25, false), (0.75, true), (0.75, true), (0.75, false)]));
        let error = expected_calibration_error(&bins).unwrap();
        assert!((error - (0.25 * 0.25 + 0.75 * (0.75 - 2.0 / 3.0))).abs() < 1e-12, "{error}");
        // Scores that are too low cost as much as scores that are too high.
        let low = expected_calibration_error(&reliability(&forecasts(&[(0.25, true)]))).unwrap();
        assert!((low - 0.75).abs() < 1e-12);
    }

    #[test]
    fn honest_scores_have_no_calibration_error() {
        let honest: Vec<(f64, bool)> = (0..8).map(|i| (0.75, i < 6)).chain((0..4).map(|i| (0.5, i < 2))).collect();
        assert_eq!(expected_calibration_error(&reliability(&forecasts(&honest))), Some(0.0));
        assert_eq!(expected_calibration_error(&reliability(&[])), None);
        assert_eq!(expected_calibration_error(&[]), None);
    }
}
