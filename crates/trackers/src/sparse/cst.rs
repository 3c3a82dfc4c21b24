//! The circulant sparse tracker, `cst` (zhang2016).

use crate::correlation::filters::{FilterKind, SparseCodeParams};
use crate::correlation::{CorrelationLocalizer, CorrelationSpec, ScaleLadderParams, ScoreParams, WindowParams, spec};
use crate::features::FeatureKind;
use crate::wary::wary;
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_tracking::motion::MotionParams;
use pursuit_tracking::policy::PolicyParams;
use pursuit_tracking::search::SearchParams;
use pursuit_tracking::{GroupParams, LocalizerRecipe, Result, TrackerRecipe};

pursuit_parameters::parameters! {
    /// Parameters of the circulant sparse tracker.
    pub struct CstParams {
        /// The code.
        pub code: SparseCodeParams = SparseCodeParams::default();
        /// The code is read through a Gaussian of this standard deviation: a shift between cells is one of several.
        pub read_sigma: f64 = 0.7, in above(0.0).at_most(10.0), unit "cells", source "ours";
        /// Share of the new appearance in the running template, per frame.
        pub learning_rate: f64 = 0.02, in 0.0..=1.0, source "ours";
        /// The window.
        pub window: WindowParams = WindowParams { padding: 2.0, ..WindowParams::default() };
        /// Sizes tried.
        pub scale_ladder: ScaleLadderParams = ScaleLadderParams { levels: 1, step: 1.03, penalty: 0.98 };
        /// The score, fitted as `docs/papers/zhang2016.md` says.
        pub score: ScoreParams =
            ScoreParams { bias: -2.2, collapse: 2.0, likeness: 8.0, ..ScoreParams::default() };
    }
}

impl LocalizerRecipe for CstParams {
    type Localizer = CorrelationLocalizer;

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<CorrelationLocalizer> {
        let spec = CorrelationSpec {
            window: self.window.clone(),
            label: spec::Label::Cells(self.read_sigma),
            learning_rate: self.learning_rate,
            ladder: self.scale_ladder.clone(),
            score: self.score.clone(),
            ..CorrelationSpec::new(
                FeatureKind::Appearance { names: frame.has_color() },
                FilterKind::Circulant(self.code.clone()),
            )
        };
        Ok(CorrelationLocalizer::new(spec, frame, &bbox))
    }
}

/// `cst`.
pub fn cst(name: &'static str) -> TrackerRecipe<CstParams> {
    let groups = GroupParams {
        motion: MotionParams::sudden(),
        policy: wary(PolicyParams::default()),
        search: SearchParams::at_last_place(),
    };
    TrackerRecipe { name, localizer: CstParams::default(), groups }
}
