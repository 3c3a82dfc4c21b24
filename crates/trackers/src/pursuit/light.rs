//! `pursuit-light`: a background-aware filter on gradients and colour names finds the place, a scale filter
//! the size; the filter's peak, the likeness to the initial template and the colours say how sure that is; a search beside
//! the main one, and all over once the target is lost, finds it again.

use crate::correlation::filters::FilterKind;
use crate::correlation::{
    ColorParams, CorrelationLocalizer, CorrelationSpec, Likeness, PeakParams, ScaleFilterParams, ScaleLadderParams,
    ScoreParams, SolverParams, Subpixel, SweepBy, WindowParams, WindowShape, spec,
};
use crate::features::FeatureKind;
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_tracking::motion::MotionParams;
use pursuit_tracking::policy::PolicyParams;
use pursuit_tracking::search::SearchParams;
use pursuit_tracking::{GroupParams, LocalizerRecipe, Result, TrackerRecipe};

/// Area of the default patch: 40 cells of 4 pixels each way (galoogahi2017: 50; ours is as accurate and faster).
const PATCH_PX: f64 = 160.0 * 160.0;

pursuit_tracking::parameters! {
    /// Parameters of `pursuit-light`, and of the filter of `pursuit`. What is not said to be ours is that of the paper it names.
    pub struct FilterParams {
        /// Standard deviation of the label as a share of the target's side.
        pub label_sigma: f64 = 0.0625, in above(0.0).below(1.0), source "galoogahi2017, section 4: 1/16";
        /// Share of the new sample per frame, η.
        pub learning_rate: f64 = 0.013, in 0.0..=1.0, source "galoogahi2017, section 4: 0.013";
        /// The window.
        pub window: WindowParams = WindowParams {
            shape: WindowShape::Square,
            padding: 4.0,
            smallest_area_px: PATCH_PX,
            largest_area_px: PATCH_PX,
            ..WindowParams::default()
        };
        /// The filter's solver.
        pub solver: SolverParams = SolverParams::default();
        /// The filter along scale.
        pub scale: ScaleFilterParams =
            ScaleFilterParams { on_return: true, size_kept_px: 8.0, size_followed_px: 24.0, ..ScaleFilterParams::default() };
        /// How responses are read.
        pub peaks: PeakParams =
            PeakParams { candidates: 3, subpixel: Subpixel::Series, ..PeakParams::default() };
        /// Colours, as evidence.
        pub color: ColorParams = ColorParams::default();
        /// The score, fitted as `docs/papers/pursuit.md` says.
        pub score: ScoreParams = ScoreParams {
            bias: -8.0,
            peak: 3.4,
            likeness: 17.2,
            likeness_by: Likeness::Cosine,
            color: 1.72,
            sweep_by: SweepBy::Score,
            ..ScoreParams::default()
        };
    }
}

impl LocalizerRecipe for FilterParams {
    type Localizer = CorrelationLocalizer;

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<CorrelationLocalizer> {
        let spec = CorrelationSpec {
            window: self.window.clone(),
            features: FeatureKind::Appearance { names: frame.has_color() },
            filter: FilterKind::Regularised(self.solver.clone()),
            label: spec::Label::OfTarget(self.label_sigma),
            learning_rate: self.learning_rate,
            first_samples: spec::FirstSamples::default(),
            ladder: ScaleLadderParams::default(),
            scale: Some(self.scale.clone()),
            peaks: self.peaks.clone(),
            color: Some(self.color.clone()),
            score: self.score.clone(),
        };
        Ok(CorrelationLocalizer::new(spec, frame, &bbox))
    }
}

/// `pursuit-light`.
pub fn light(name: &'static str) -> TrackerRecipe<FilterParams> {
    let groups = GroupParams {
        motion: MotionParams { acceleration: 30.0, ..MotionParams::default() },
        policy: PolicyParams {
            occluded_below: 0.8,
            seen_from: 0.9,
            found_from: 0.85,
            learn_from: 0.8,
            lost_below: 0.1,
            occluded_score: 1.0,
            ..PolicyParams::default()
        },
        search: SearchParams {
            prediction_gain: 0.0,
            reach: 5.0,
            wide_windows: 5,
            side_windows: 1,
            keep_inside: true,
            ..SearchParams::default()
        },
    };
    TrackerRecipe { name, localizer: FilterParams::default(), groups }
}
