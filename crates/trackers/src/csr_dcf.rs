//! `csr-dcf`: the discriminative correlation filter with channel and spatial reliability (lukezic2017), known as CSRT. A mask of the
//! target says which cells the filter may have, and each channel counts as far as it is to be relied upon.

use crate::correlation::filters::FilterKind;
use crate::correlation::{
    CorrelationLocalizer, CorrelationSpec, GuideParams, ReliabilityParams, ScaleFilterParams, ScoreParams,
    WindowParams, WindowShape, spec,
};
use crate::features::FeatureKind;
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_tracking::motion::MotionParams;
use pursuit_tracking::policy::PolicyParams;
use pursuit_tracking::search::SearchParams;
use pursuit_tracking::{GroupParams, LocalizerRecipe, Result, TrackerRecipe};

pursuit_parameters::parameters! {
    /// Parameters of `csr-dcf`.
    pub struct CsrDcfParams {
        /// Standard deviation of the label.
        pub label_sigma: f64 = 1.0, in above(0.0), unit "cells", source "lukezic2017, released code: 1";
        /// Share of the new filter, η.
        pub learning_rate: f64 = 0.02, in 0.0..=1.0, source "lukezic2017, section 4.1: 0.02";
        /// The window: lukezic2017, released code has a square of four times the target's mean side, sampled to 200² pixels at most.
        pub window: WindowParams = WindowParams {
            shape: WindowShape::Square,
            padding: 3.0,
            smallest_area_px: 22_500.0,
            largest_area_px: 40_000.0,
            ..WindowParams::default()
        };
        /// The filter.
        pub reliability: ReliabilityParams = ReliabilityParams::default();
        /// The mask that guides it.
        pub guide: GuideParams = GuideParams::default();
        /// The filter along scale.
        pub scale: ScaleFilterParams = ScaleFilterParams {
            scales: 33,
            interpolate: false,
            label_sigma: 1.436,
            ..ScaleFilterParams::default()
        };
        /// The score, fitted as `docs/papers/lukezic2017.md` says.
        pub score: ScoreParams =
            ScoreParams { bias: -4.7, collapse: 0.6, likeness: 2.8, first_colors: 5.1, ..ScoreParams::default() };
    }
}

impl LocalizerRecipe for CsrDcfParams {
    type Localizer = CorrelationLocalizer;

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<CorrelationLocalizer> {
        let spec = CorrelationSpec {
            window: self.window.clone(),
            label: spec::Label::Cells(self.label_sigma),
            learning_rate: self.learning_rate,
            scale: Some(self.scale.clone()),
            score: self.score.clone(),
            ..CorrelationSpec::new(
                FeatureKind::Appearance { names: frame.has_color() },
                FilterKind::Reliable(self.reliability.clone()),
            )
        };
        CorrelationLocalizer::new(spec, frame, &bbox).guided(&self.guide, frame, bbox)
    }
}

/// `csr-dcf`.
pub fn csr_dcf(name: &'static str) -> TrackerRecipe<CsrDcfParams> {
    let groups = GroupParams {
        motion: MotionParams::calm(),
        policy: PolicyParams::default(),
        search: SearchParams { wide_windows: 6, ..SearchParams::at_last_place() },
    };
    TrackerRecipe { name, localizer: CsrDcfParams::default(), groups }
}
