//! Filters confined to the target and trained on its whole surroundings: `bacf` (galoogahi2017) and `strcf` (li2018).

use crate::correlation::filters::FilterKind;
use crate::correlation::{
    CorrelationLocalizer, CorrelationSpec, GuideParams, ScaleLadderParams, ScoreParams, SolverParams, WindowParams,
    WindowShape, spec,
};
use crate::features::FeatureKind;
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_tracking::motion::MotionParams;
use pursuit_tracking::policy::PolicyParams;
use pursuit_tracking::search::SearchParams;
use pursuit_tracking::{GroupParams, LocalizerRecipe, Result, TrackerRecipe};

pursuit_parameters::parameters! {
    /// Parameters of the regularised correlation filters.
    pub struct RegularisedParams {
        /// Standard deviation of the label as a share of √(width · height) of the target.
        pub label_sigma: f64 = 0.0625, in above(0.0).below(1.0), source "galoogahi2017, section 4: 1/16; li2018, released code: 1/16";
        /// Share of the new sample in the model, η.
        pub learning_rate: f64 = 0.013, in 0.0..=1.0, source "galoogahi2017, eq. 11, section 4: 0.013; li2018: 1";
        /// The window: galoogahi2017, released code has a square of five times the target's mean side, sampled to 200² pixels.
        pub window: WindowParams = WindowParams {
            shape: WindowShape::Square,
            padding: 4.0,
            smallest_area_px: 40_000.0,
            largest_area_px: 40_000.0,
            ..WindowParams::default()
        };
        /// The solver.
        pub solver: SolverParams = SolverParams::default();
        /// A mask that says what of the box is learnt.
        pub guide: GuideParams = GuideParams::none();
        /// Sizes tried.
        pub scale_ladder: ScaleLadderParams = ScaleLadderParams { levels: 2, step: 1.01, penalty: 1.0 };
        /// The score, fitted as `docs/papers/bacf.md` says.
        pub score: ScoreParams =
            ScoreParams { bias: -7.3, psr: 1.3, collapse: 0.5, likeness: 1.0, first_colors: 4.7, ..ScoreParams::default() };
    }
    renamed { "scale" => ["scale_ladder"] }
}

impl LocalizerRecipe for RegularisedParams {
    type Localizer = CorrelationLocalizer;

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<CorrelationLocalizer> {
        let spec = CorrelationSpec {
            window: self.window.clone(),
            label: spec::Label::OfTarget(self.label_sigma),
            learning_rate: self.learning_rate,
            ladder: self.scale_ladder.clone(),
            score: self.score.clone(),
            ..CorrelationSpec::new(
                FeatureKind::Appearance { names: frame.has_color() },
                FilterKind::Regularised(self.solver.clone()),
            )
        };
        CorrelationLocalizer::new(spec, frame, &bbox).guided(&self.guide, frame, bbox)
    }
}

fn recipe(name: &'static str, localizer: RegularisedParams) -> TrackerRecipe<RegularisedParams> {
    let groups = GroupParams {
        motion: MotionParams::calm(),
        policy: PolicyParams::default(),
        search: SearchParams { wide_windows: 6, ..SearchParams::at_last_place() },
    };
    TrackerRecipe { name, localizer, groups }
}

/// `bacf`: the background-aware correlation filter.
pub fn bacf(name: &'static str) -> TrackerRecipe<RegularisedParams> {
    recipe(name, RegularisedParams::default())
}

/// `strcf`: the spatial-temporal regularised correlation filter, learned anew in each frame, near the last.
pub fn strcf(name: &'static str) -> TrackerRecipe<RegularisedParams> {
    let localizer = RegularisedParams {
        learning_rate: 1.0,
        // li2018, released code: from 150² to 200² pixels.
        window: WindowParams { smallest_area_px: 22_500.0, ..RegularisedParams::default().window },
        solver: SolverParams { temporal_weight: 15.0, spatial_weight: 1e-6, ..SolverParams::default() },
        // Fitted as `docs/papers/strcf.md` says.
        score: ScoreParams {
            bias: -5.6,
            psr: 0.86,
            collapse: 3.9,
            likeness: 4.9,
            first_colors: 2.6,
            ..ScoreParams::default()
        },
        ..RegularisedParams::default()
    };
    recipe(name, localizer)
}
