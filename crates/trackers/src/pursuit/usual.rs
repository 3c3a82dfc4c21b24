//! What is usual of this target, and judging what was found by how far it is from that.

use super::expert::{Expert, Remark};
use super::fusion::Fusion;
use super::judge::JointEvidence;
use super::localizer::WitnessLocalizer;
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_tracking::Look;
use serde::{Deserialize, Serialize};

/// Share of a frame in the plain means.
const RATE: f64 = 0.05;
/// Frames that a spread is taken over at most.
const MOST_FRAMES: f64 = 500.0;
/// Frames for which it is taken for granted what the spread is before the target has shown its own.
const PRIOR_FRAMES: f64 = 20.0;
/// Spread of the likeness to the first colours of most targets.
const PRIOR_COLORS: f64 = 0.07;
/// Spread of the likeness to LightFC's first features of most targets.
const PRIOR_EMBEDDING: f64 = 0.06;
/// Fewer frames than this say nothing of what is usual.
const LEAST_FRAMES: f64 = 3.0;
/// One frame says no more than this many deviations against a target, or for it.
const WORST: f64 = -6.0;
const BEST: f64 = 2.0;
/// Of a target with sides of so many pixels what departs from the usual is worth 1/√2 of what it says.
const SMALL_PX: f64 = 24.0;

/// What the departure of the looks in `bbox` is worth: in a small one there is much of what lies behind the target.
fn worth(bbox: &BBox) -> f64 {
    (1.0 + SMALL_PX * SMALL_PX / bbox.area().max(1.0)).sqrt().recip()
}

/// What is usual of the target.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Usual {
    /// Likeness to the initial template and log odds of LightFC's score; `None` before anything was sure.
    plain: Option<(f64, f64)>,
    colors: Spread,
    embedding: Spread,
}

/// Mean and variance of a figure.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
struct Spread {
    frames: f64,
    mean: f64,
    variance: f64,
}

impl Spread {
    fn learn(&mut self, value: f64) {
        self.frames = (self.frames + 1.0).min(MOST_FRAMES);
        let difference = value - self.mean;
        let share = 1.0 / self.frames;
        self.mean += share * difference;
        self.variance = (1.0 - share) * (self.variance + share * difference * difference);
    }

    /// How far `value` is from what is usual, in deviations, of a figure whose deviation is `prior` of most targets.
    fn departure(&self, value: f64, prior: f64) -> f64 {
        if self.frames < LEAST_FRAMES {
            return 0.0;
        }
        let variance = (PRIOR_FRAMES * prior * prior + self.frames * self.variance) / (PRIOR_FRAMES + self.frames);
        ((value - self.mean) / variance.sqrt()).clamp(WORST, BEST)
    }

    fn is_sound(&self) -> bool {
        (0.0..=MOST_FRAMES).contains(&self.frames) && self.mean.is_finite() && (0.0..=f64::MAX).contains(&self.variance)
    }
}

impl Usual {
    /// Whether a state that was read is one that this can be in.
    pub fn is_sound(&self) -> bool {
        let (likeness, lightfc) = self.plain.unwrap_or_default();
        likeness.is_finite() && lightfc.is_finite() && self.colors.is_sound() && self.embedding.is_sound()
    }

    /// A frame in which the target was sure.
    pub fn learn(&mut self, sure: &JointEvidence) {
        let (likeness, lightfc) = self.plain.unwrap_or((sure.likeness, sure.lightfc));
        self.plain = Some((likeness + RATE * (sure.likeness - likeness), lightfc + RATE * (sure.lightfc - lightfc)));
    }

    /// A frame in which the target was believed, whose likeness to the first colours and, where that was asked, to LightFC's first features
    /// are these. What is believed without being sure belongs to what is usual: a target that changes is not to run out of it.
    pub fn learn_looks(&mut self, colors: f64, embedding: Option<f64>) {
        self.colors.learn(colors);
        if let Some(embedding) = embedding {
            self.embedding.learn(embedding);
        }
    }

    /// `likeness` to the initial template less what is usual.
    pub fn likeness_fall(&self, likeness: f64) -> f64 {
        self.plain.map_or(0.0, |usual| likeness - usual.0)
    }

    /// Log odds of LightFC's score less what is usual.
    pub fn lightfc_fall(&self, lightfc: f64) -> f64 {
        self.plain.map_or(0.0, |usual| lightfc - usual.1)
    }

    /// How far a likeness to the first colours is from what is usual, in deviations.
    pub fn colors_departure(&self, likeness: f64) -> f64 {
        self.colors.departure(likeness, PRIOR_COLORS)
    }

    /// The same of LightFC's features.
    pub fn embedding_departure(&self, likeness: f64) -> f64 {
        self.embedding.departure(likeness, PRIOR_EMBEDDING)
    }
}

impl WitnessLocalizer {
    /// Has what was found judged by how far it is from what is usual of this target too; and the likeness of its colours to the first ones.
    pub(super) fn judged(&mut self, frame: &Frame, mut fused: Fusion, look: Look) -> (Fusion, f64) {
        let bbox = fused.bbox(&self.params.fusion);
        let colors = bbox.map_or(0.0, |bbox| self.first_colors.likeness(frame, &bbox));
        let remembered = || self.expert.as_ref().map_or(Remark::USUAL, Expert::remark);
        let embedding = fused.remark.unwrap_or_else(remembered).embedding;
        let mut departures = (self.usual.colors_departure(colors), self.usual.embedding_departure(embedding));
        if look != Look::Centred {
            // Followed from frame to frame, a small target passes before one thing and another; one that turns up has to look right.
            let worth = bbox.map_or(1.0, |bbox| worth(&bbox));
            departures = (worth * departures.0, worth * departures.1);
        }
        let judge = match look {
            Look::Centred => &self.params.returns,
            _ if self.doubted => &self.params.doubted,
            _ => &self.params.judge,
        };
        fused.heard(judge, |evidence| (evidence.colors_fall, evidence.embedding_fall) = departures);
        (fused, colors)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sure() -> JointEvidence {
        JointEvidence { likeness: 0.7, lightfc: 1.5, ..JointEvidence::default() }
    }

    #[test]
    fn a_departure_is_from_the_mean_in_deviations() {
        let seen = [0.9, 0.82, 0.95, 0.7, 0.88, 0.91, 0.77];
        let mut usual = Usual::default();
        for (frame, colors) in seen.into_iter().enumerate() {
            usual.learn_looks(colors, None);
            let so_far = &seen[..=frame];
            let frames = so_far.len() as f64;
            let mean = so_far.iter().sum::<f64>() / frames;
            let squares: f64 = so_far.iter().map(|v| (v - mean).powi(2)).sum();
            let deviation = ((PRIOR_FRAMES * PRIOR_COLORS.powi(2) + squares) / (PRIOR_FRAMES + frames)).sqrt();
            let want = if frames < LEAST_FRAMES { 0.0 } else { (0.75 - mean) / deviation };
            assert!((usual.colors_departure(0.75) - want).abs() < 1e-12, "{frame}");
        }
        assert_eq!(usual.embedding_departure(0.1), 0.0, "LightFC was never asked");
        assert_eq!((usual.colors_departure(0.0), usual.colors_departure(1.9)), (WORST, BEST));
    }

    #[test]
    fn colors_that_change_all_the_time_are_no_reason_for_doubt() {
        let (mut steady, mut changing) = (Usual::default(), Usual::default());
        for frame in 0..200 {
            steady.learn_looks(0.9 + 0.01 * f64::from(frame % 2), Some(0.9));
            changing.learn_looks(0.8 + 0.2 * f64::from(frame % 2), Some(0.9 - 0.4 * f64::from(frame % 2)));
        }
        assert!(steady.colors_departure(0.6) < -5.0 && changing.colors_departure(0.6) > -4.0);
        assert_eq!(steady.embedding_departure(0.5), WORST);
        assert!(changing.embedding_departure(0.5) > -1.5);
    }

    #[test]
    fn looks_of_a_small_target_are_worth_less() {
        let worth = |side| worth(&BBox::from_ltwh(3.0, 4.0, side, side));
        assert!((worth(SMALL_PX) - 0.5_f64.sqrt()).abs() < 1e-12);
        assert!(worth(12.0) < 0.45 && worth(200.0) > 0.99 && worth(0.0) > 0.0);
    }

    #[test]
    fn falls_are_from_the_smoothed_means() {
        let mut usual = Usual::default();
        assert_eq!((usual.likeness_fall(0.3), usual.lightfc_fall(0.3)), (0.0, 0.0));
        usual.learn(&sure());
        usual.learn(&JointEvidence { likeness: 0.5, lightfc: 0.5, ..sure() });
        assert!((usual.likeness_fall(0.6) - (0.6 - 0.69)).abs() < 1e-12);
        assert!((usual.lightfc_fall(1.0) - (1.0 - 1.45)).abs() < 1e-12);
    }

    #[test]
    fn what_was_stored_is_out_of_range_or_the_same() {
        let mut usual = Usual::default();
        usual.learn(&sure());
        usual.learn_looks(0.9, Some(0.8));
        assert!(usual.is_sound());
        let negative = Usual { colors: Spread { variance: -1.0, ..usual.colors }, ..usual };
        let endless = Usual { embedding: Spread { frames: f64::INFINITY, ..usual.embedding }, ..usual };
        assert!(!negative.is_sound() && !endless.is_sound());
        assert!(!Usual { plain: Some((f64::NAN, 0.0)), ..usual }.is_sound());
    }
}
