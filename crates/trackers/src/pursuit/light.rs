//! `pursuit-light`: a background-aware filter on gradients and colour names finds the place, a scale filter
//! the size; the filter's peak, the likeness to the initial template and the colours say how sure that is; a search beside
//! the main one, and all over once the target is lost, finds it again.

use super::FilterParams;
use crate::correlation::filters::FilterKind;
use crate::correlation::{CorrelationLocalizer, CorrelationSpec, ScoreParams, spec};
use crate::features::FeatureKind;
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_tracking::motion::MotionParams;
use pursuit_tracking::policy::{CalibratedParams, PolicyParams};
use pursuit_tracking::search::SearchParams;
use pursuit_tracking::{GroupParams, LocalizerRecipe, Result, TrackerRecipe};

impl LocalizerRecipe for FilterParams {
    type Localizer = CorrelationLocalizer;

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<CorrelationLocalizer> {
        let spec = CorrelationSpec {
            window: self.window.clone(),
            label: spec::Label::OfTarget(self.label_sigma),
            learning_rate: self.learning_rate,
            scale: Some(self.scale.clone()),
            peaks: self.peaks.clone(),
            color: Some(self.color.clone()),
            score: self.score.clone(),
            ..CorrelationSpec::new(
                FeatureKind::Appearance { names: frame.has_color() },
                FilterKind::Regularised(self.solver.clone()),
            )
        };
        CorrelationLocalizer::new(spec, frame, &bbox).guided(&self.guide, frame, bbox)
    }
}

/// `pursuit-light`.
pub fn light(name: &'static str) -> TrackerRecipe<FilterParams> {
    let groups = GroupParams {
        motion: MotionParams::calm(),
        policy: PolicyParams {
            occluded_below: 0.8,
            seen_from: 0.9,
            found_from: 0.85,
            learn_from: 0.8,
            calibrated: CalibratedParams { lost_below: 0.1, ..CalibratedParams::default() },
            occluded_score: 1.0,
            ..PolicyParams::default()
        },
        search: SearchParams {
            reach: 5.0,
            wide_windows: 5,
            side_windows: 1,
            keep_inside: true,
            ..SearchParams::at_last_place()
        },
    };
    let defaults = FilterParams::default();
    // Beside the other witness of `pursuit` the colours of the first frame say nothing new; alone the filter needs them.
    let score = ScoreParams { bias: -11.0, first_colors: 3.6, ..defaults.score };
    TrackerRecipe { name, localizer: FilterParams { score, ..defaults }, groups }
}
