//! The sum of template and pixel-wise learners, `staple` (bertinetto2016): a correlation filter on HOG, which knows the
//! shape, beside colour histograms, which do not mind deformation.

use crate::correlation::filters::FilterKind;
use crate::correlation::{
    ColorParams, CorrelationLocalizer, CorrelationSpec, ScaleFilterParams, ScoreParams, WindowParams, WindowShape, spec,
};
use crate::features::FeatureKind;
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_tracking::motion::MotionParams;
use pursuit_tracking::policy::PolicyParams;
use pursuit_tracking::search::SearchParams;
use pursuit_tracking::{GroupParams, LocalizerRecipe, Result, TrackerRecipe};

pursuit_parameters::parameters! {
    /// Parameters of the sum of template and pixel-wise learners.
    pub struct StapleParams {
        /// Regularisation of the template as a share of the mean energy of a frequency, λ.
        pub lambda: f64 = 1e-3, in above(0.0), source "bertinetto2016, section 4.2";
        /// Standard deviation of the label as a share of √(width · height) of the target.
        pub label_sigma: f64 = 0.0625, in above(0.0), source "bertinetto2016, released code: 1/16";
        /// Share of the new template per frame, η_tmpl.
        pub learning_rate: f64 = 0.01, in 0.0..=1.0, source "bertinetto2016, table 1: 0.01";
        /// The window: bertinetto2016, released code has a margin of half the mean side all round, sampled to 150² pixels.
        pub window: WindowParams = WindowParams {
            shape: WindowShape::Margin,
            padding: 1.0,
            smallest_area_px: 22_500.0,
            largest_area_px: 22_500.0,
            ..WindowParams::default()
        };
        /// The colours beside the template.
        pub color: ColorParams = ColorParams { share: 0.3, ..ColorParams::default() };
        /// The filter along scale.
        pub scale: ScaleFilterParams = ScaleFilterParams { label_sigma: 1.0, ..ScaleFilterParams::default() };
        /// The score, fitted as `docs/papers/staple.md` says, and less .4: by the fit it told a quarter of the frames without the target.
        pub score: ScoreParams = ScoreParams {
            bias: -5.3,
            psr: 1.05,
            collapse: 1.3,
            likeness: 6.3,
            first_colors: 3.7,
            ..ScoreParams::default()
        };
    }
}

impl LocalizerRecipe for StapleParams {
    type Localizer = CorrelationLocalizer;

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<CorrelationLocalizer> {
        let spec = CorrelationSpec {
            window: self.window.clone(),
            label: spec::Label::OfTarget(self.label_sigma),
            learning_rate: self.learning_rate,
            scale: Some(self.scale.clone()),
            color: Some(self.color.clone()),
            score: self.score.clone(),
            ..CorrelationSpec::new(FeatureKind::ColorHog, FilterKind::Mosse { lambda: self.lambda })
        };
        Ok(CorrelationLocalizer::new(spec, frame, &bbox))
    }
}

/// `staple`.
pub fn staple(name: &'static str) -> TrackerRecipe<StapleParams> {
    let groups = GroupParams {
        motion: MotionParams::sudden(),
        policy: PolicyParams::default(),
        search: SearchParams::at_last_place(),
    };
    TrackerRecipe { name, localizer: StapleParams::default(), groups }
}
