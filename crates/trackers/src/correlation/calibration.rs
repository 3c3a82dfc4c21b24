use super::PeakQuality;
use serde::{Deserialize, Serialize};

/// A peak below this share of the usual one has collapsed (β₁ of wang2017, section 3.3).
const COLLAPSED: f64 = 0.6;

/// Share of a new response in the mean that later ones are compared with.
const MEMORY: f64 = 0.05;

/// Probability that the box is right, a logistic function of what is known of the response and of the target's looks.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// Constant.
    pub bias: f64,
    /// Weight of ln PSR.
    pub psr: f64,
    /// Weight of ln (peak / 0.6 of the mean peak so far) where that is negative: a peak as usual says nothing new, one that
    /// collapses tells of an occlusion (wang2017, section 3.3).
    pub collapse: f64,
    /// Weight of the likeness to the first view.
    pub first_view: f64,
}

/// What a measurement is judged by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evidence {
    /// Figures of the response.
    pub quality: PeakQuality,
    /// The peak relative to the usual one.
    pub peak_ratio: f64,
    /// Likeness to the first view, `[−1, 1]`.
    pub first_view: f64,
}

impl Calibration {
    /// The probability, in `[0, 1]`.
    pub fn probability(&self, evidence: &Evidence) -> f64 {
        let ln = |v: f64| v.max(1e-3).ln();
        let z = self.bias
            + self.psr * ln(evidence.quality.psr)
            + self.collapse * (ln(evidence.peak_ratio) - ln(COLLAPSED)).min(0.0)
            + self.first_view * evidence.first_view;
        1.0 / (1.0 + (-z).exp())
    }
}

/// How high peaks are while the target is believed to be seen: that depends on the target and its surroundings.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct UsualPeak {
    mean: Option<f64>,
    /// The peak of the last frame, which becomes part of the usual if it is believed.
    last: Option<f64>,
}

impl UsualPeak {
    /// `peak` relative to the usual one; remembers it until the next.
    pub fn ratio(&mut self, peak: f64) -> f64 {
        self.last = Some(peak);
        self.mean.map_or(1.0, |mean| peak / mean.max(1e-6))
    }

    /// The last peak was the target's.
    pub fn believe(&mut self) {
        if let Some(peak) = self.last.take() {
            let mean = self.mean.get_or_insert(peak);
            *mean += MEMORY * (peak - *mean);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn collapse_and_strange_looks_count_against_the_target() {
        let calibration = Calibration { bias: -2.0, psr: 0.5, collapse: 2.0, first_view: 5.0 };
        let quality = PeakQuality { peak: 0.5, psr: 12.0, apce: 30.0 };
        let score = |peak_ratio, first_view| calibration.probability(&Evidence { quality, peak_ratio, first_view });
        let z = -2.0 + 0.5 * 12.0_f64.ln() + 5.0 * 0.6;
        assert!((score(1.0, 0.6) - 1.0 / (1.0 + (-z).exp())).abs() < 1e-12);
        assert_eq!(score(0.7, 0.6), score(1.3, 0.6));
        assert!(score(0.5, 0.6) < score(0.61, 0.6) && score(1.0, 0.1) < score(1.0, 0.6));
        assert!(score(0.0, -1.0) >= 0.0 && score(f64::MAX, 1.0) <= 1.0);
    }

    #[test]
    fn only_believed_peaks_are_usual() {
        let mut usual = UsualPeak::default();
        assert_eq!(usual.ratio(0.4), 1.0);
        usual.believe();
        assert!((usual.ratio(0.2) - 0.5).abs() < 1e-12);
        assert!((usual.ratio(0.6) - 1.5).abs() < 1e-12);
        usual.believe();
        assert!((usual.ratio(0.41) - 1.0).abs() < 1e-12);
    }
}
