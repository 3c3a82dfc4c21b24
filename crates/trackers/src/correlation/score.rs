use super::params::ScoreParams;
use crate::appearance::FirstColors;
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_vision::fourier::PeakQuality;
use serde::{Deserialize, Serialize};

/// Values below this count as this much where a logarithm is taken.
const LEAST: f64 = 1e-6;

/// What a place is judged by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evidence {
    /// Height of the response's peak.
    pub peak: f64,
    /// Peak-to-sidelobe ratio of the response (bolme2010, section 3.5).
    pub psr: f64,
    /// The peak relative to the usual one.
    pub peak_ratio: f64,
    /// Likeness to the initial template, `[−1, 1]`.
    pub likeness: f64,
    /// Mean likelihood of the colours in the box, `[0, 1]`; ½ where colours are not looked at.
    pub color: f64,
}

pursuit_tracking::figures! {
    /// What a correlation filter says of a place.
    pub struct CorrelationFigures {
        /// Height of the response's peak.
        peak;
        /// Peak-to-sidelobe ratio of the response (bolme2010, section 3.5).
        psr;
        /// Average peak-to-correlation energy of the response (wang2017, eq. 9).
        apce;
        /// The peak relative to the usual one.
        peak_ratio;
        /// Likeness to the initial template, -1 to 1.
        likeness;
        /// Mean likelihood of the colours in the box; one half where colours are not looked at.
        color;
        /// How alike the colours in the box are to those of the first frame, 0 to 1; 0 where they are not looked at.
        first_colors;
    }
}

fn ln(v: f64) -> f64 {
    v.max(LEAST).ln()
}

impl ScoreParams {
    /// ln of p / (1 − p) of the probability p that the box is right.
    pub fn log_odds(&self, seen: &Evidence) -> f64 {
        self.bias
            + self.psr * ln(seen.psr)
            + self.collapse * (ln(seen.peak_ratio) - ln(self.collapsed_below)).min(0.0)
            + self.likeness * seen.likeness
            + self.peak * ln(seen.peak)
            + self.color * ln(seen.color)
    }

    /// The colours of the target that starts at `bbox`, where they are part of the score.
    pub fn first_colors(&self, frame: &Frame, bbox: &BBox) -> Option<FirstColors> {
        (self.first_colors != 0.0).then(|| FirstColors::new(frame, bbox))
    }

    /// Whether a state that was read has them where they are part of the score.
    pub fn fits(&self, first_colors: Option<&FirstColors>) -> bool {
        first_colors.is_none_or(FirstColors::is_sound) && first_colors.is_some() == (self.first_colors != 0.0)
    }
}

/// How clearly a response's peak stands out, of rows of `width`; a square of half side `sidelobe_share` of the shorter side
/// about the peak is no sidelobe.
pub fn peak_quality(response: &[f32], width: usize, sidelobe_share: f64) -> PeakQuality {
    let shorter = width.min(response.len() / width.max(1));
    PeakQuality::of(response, width, (sidelobe_share * shorter as f64).ceil() as usize)
}

/// How high peaks are while the target is believed to be seen: that depends on the target and its surroundings.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct PeakBaseline {
    mean: Option<f64>,
}

impl PeakBaseline {
    /// `peak` relative to the usual one; 1 before any has been believed.
    pub fn ratio(&self, peak: f64) -> f64 {
        self.mean.map_or(1.0, |mean| peak / mean.max(LEAST))
    }

    /// `peak` was the target's; it becomes part of the usual by `rate`.
    pub fn believe(&mut self, peak: f64, rate: f64) {
        let mean = self.mean.get_or_insert(peak);
        *mean += rate * (peak - *mean);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_vision::fourier::{average_peak_to_correlation_energy, peak_to_sidelobe_ratio};

    #[test]
    fn the_score_is_logistic_in_weighted_evidence() {
        let score = ScoreParams {
            bias: -2.0,
            psr: 0.5,
            collapse: 2.0,
            likeness: 5.0,
            peak: 0.7,
            color: 1.3,
            ..ScoreParams::default()
        };
        let seen = Evidence { peak: 0.5, psr: 12.0, peak_ratio: 0.3, likeness: 0.6, color: 0.8 };
        let want =
            -2.0 + 0.5 * 12.0_f64.ln() + 2.0 * 0.5_f64.ln() + 5.0 * 0.6 + 0.7 * 0.5_f64.ln() + 1.3 * 0.8_f64.ln();
        assert!((score.log_odds(&seen) - want).abs() < 1e-12);
        let odds = |peak_ratio, likeness| score.log_odds(&Evidence { peak_ratio, likeness, ..seen });
        assert_eq!(odds(0.7, 0.6), odds(1.3, 0.6));
        assert!(odds(0.5, 0.6) < odds(0.61, 0.6) && odds(1.0, 0.1) < odds(1.0, 0.6));
        assert!(odds(0.0, -1.0).is_finite() && odds(f64::MAX, 1.0).is_finite());
    }

    #[test]
    fn only_believed_peaks_are_usual() {
        let mut usual = PeakBaseline::default();
        assert_eq!(usual.ratio(0.4), 1.0);
        usual.believe(0.4, 0.05);
        assert!((usual.ratio(0.2) - 0.5).abs() < 1e-12 && (usual.ratio(0.6) - 1.5).abs() < 1e-12);
        usual.believe(0.6, 0.05);
        assert!((usual.ratio(0.41) - 1.0).abs() < 1e-12);
        let mut zero = PeakBaseline::default();
        zero.believe(0.0, 0.05);
        assert!(zero.ratio(1.0).is_finite());
    }

    #[test]
    fn quality_is_that_of_the_response() {
        let mut response = vec![0.0_f32; 64];
        response[9] = 2.0;
        response[60] = 1.0;
        let quality = peak_quality(&response, 8, 0.1);
        assert_eq!(quality.peak, 2.0);
        assert_eq!(quality.psr, peak_to_sidelobe_ratio(&response, 8, 1));
        assert_eq!(quality.apce, average_peak_to_correlation_energy(&response));
    }
}
