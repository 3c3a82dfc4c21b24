//! The detector as qu2010 has it: a preset.

use super::{
    BackgroundKind, ColorsParams, GhostParams, GroupingParams, LightParams, MotionDetectorParams, ShadeParams,
    StartParams,
};
use pursuit_parameters::{Parameter, Parameters, Value};
use pursuit_tracking::{Detector, DetectorRecipe, Figure, Result};

/// Parameters of the detector `motion` with the paper's own for defaults: the difference from the first frame, opening and closing,
/// and the matching rule. What the paper has no word of is switched off.
#[derive(Debug, Clone, PartialEq)]
pub struct PaperParams(MotionDetectorParams);

impl Default for PaperParams {
    fn default() -> Self {
        let usual = MotionDetectorParams::default();
        Self(MotionDetectorParams {
            background: BackgroundKind::Fixed,
            sight_px: 0,
            join_cut: 0.0,
            // The first frame is the background, from the second on.
            settled_frames: 1,
            ghost: GhostParams { ratio: 1e9, ..usual.ghost },
            shade: ShadeParams { alike: 2.0, ..usual.shade },
            grouping: GroupingParams { share: 1.0, ..usual.grouping },
            start: StartParams { small: 0.0, part: 1.0, ..usual.start },
            colors: ColorsParams { bands: 0, ..usual.colors },
            // A picture that has changed as a whole is what has changed: nothing is explained by the light.
            light: LightParams { changed: 1.0, replaced: 1.0, exposure: false, shake: 0.0, noise: 0.0, ..usual.light },
            ..usual
        })
    }
}

impl Parameters for PaperParams {
    fn schema(&self) -> Vec<Parameter> {
        self.0.schema()
    }

    fn check_all(&self) -> std::result::Result<(), (String, String)> {
        self.0.check_all()
    }

    fn set(&mut self, path: &str, value: &Value) -> std::result::Result<(), String> {
        self.0.set(path, value)
    }

    fn renamed(&self, path: &str) -> Option<Vec<String>> {
        self.0.renamed(path)
    }
}

impl DetectorRecipe for PaperParams {
    const FIGURES: &[&[Figure]] = MotionDetectorParams::FIGURES;

    fn detector(&self) -> Result<Box<dyn Detector>> {
        self.0.detector()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_imaging::{Frame, Image, Pixels};

    /// Somebody walks in from the left before a wall, whose light is `gain`.
    fn frame(k: u64, gain: f64) -> Frame {
        let walker = |x: usize, y: usize| (4 * k as usize..4 * k as usize + 20).contains(&x) && (30..90).contains(&y);
        let seen = |x: usize, y: usize| if k > 0 && walker(x, y) { [30; 3] } else { [(gain * 120.0) as u8; 3] };
        let image = Image::from_fn(160, 120, seen).unwrap();
        Frame::new(k, k as f64 * 0.2, Pixels::Rgb8(image.into()))
    }

    fn found(detector: &mut dyn Detector, k: u64, gain: f64) -> Vec<pursuit_geometry::BBox> {
        detector.detect(&frame(k, gain), &[]).unwrap().iter().map(|d| d.bbox).collect()
    }

    #[test]
    fn the_first_frame_is_the_background_for_ever() {
        let mut paper = PaperParams::default().detector().unwrap();
        assert!(found(&mut *paper, 0, 1.0).is_empty());
        for k in 1..30 {
            let boxes = found(&mut *paper, k, 1.0);
            assert!(boxes.len() == 1 && (boxes[0].left() - 4.0 * k as f64).abs() < 2.0, "{k}: {boxes:?}");
        }
    }

    #[test]
    fn another_light_is_followed_by_the_default_and_not_by_the_paper() {
        let after = |detector: &mut dyn Detector| {
            (0..8).for_each(|k| drop(found(detector, k, 1.0)));
            (8..12).map(|k| found(detector, k, 0.6)).next_back().unwrap()
        };
        let usual = after(&mut *MotionDetectorParams::default().detector().unwrap());
        assert_eq!(usual.len(), 1, "the walker");
        let paper = after(&mut *PaperParams::default().detector().unwrap());
        assert!(
            paper.iter().all(|b| b.width() > 80.0),
            "the whole picture, or nothing that the rule admits: {paper:?}"
        );
    }

    #[test]
    fn settings_are_those_of_motion() {
        let changed = PaperParams::default().with("qu2010", &"light.exposure = true".parse().unwrap()).unwrap();
        assert!(changed != PaperParams::default());
        assert!(PaperParams::default().with("qu2010", &"gait = 1".parse().unwrap()).is_err());
    }
}
