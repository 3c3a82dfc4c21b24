//! The filter of minimum output sum of squared error, `mosse` (bolme2010).

use crate::correlation::filters::FilterKind;
use crate::correlation::{CorrelationLocalizer, CorrelationSpec, ScoreParams, WindowParams, spec};
use crate::features::FeatureKind;
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_tracking::motion::MotionParams;
use pursuit_tracking::policy::{PaperParams, PolicyParams};
use pursuit_tracking::search::SearchParams;
use pursuit_tracking::{GroupParams, LocalizerRecipe, Result, TrackerRecipe};

pursuit_parameters::parameters! {
    /// Parameters of the filter of minimum output sum of squared error.
    pub struct MosseParams {
        /// Standard deviation of the wanted response in patch pixels.
        pub label_sigma_px: f64 = 2.0, in above(0.0), unit "px", source "bolme2010, section 3.2: 2";
        /// Share of the new frame in the filter, η.
        pub learning_rate: f64 = 0.125, in 0.0..=1.0, source "bolme2010, eqs. 10–12: 0.125";
        /// First samples: the target as it is and small warps of it.
        pub first_samples: usize = 8, in 1..=64, source "bolme2010, section 3.3: 8";
        /// Largest turn of a first sample.
        pub first_turn_rad: f64 = 0.1, in 0.0..=1.0, unit "rad", source "ours";
        /// Largest change of size of a first sample.
        pub first_resize: f64 = 0.1, in 0.0..=0.5, source "ours";
        /// Regularisation ε as a share of the mean energy of a frequency.
        pub epsilon: f64 = 0.1, in above(0.0), source "bolme2010, section 3.3";
        /// The window.
        pub window: WindowParams =
            WindowParams { padding: 1.5, smallest_area_px: 1024.0, largest_area_px: 4096.0, ..WindowParams::default() };
        /// The score, fitted as `docs/papers/mosse.md` says.
        pub score: ScoreParams = ScoreParams { bias: -1.9, collapse: 1.8, likeness: 4.5, ..ScoreParams::default() };
    }
}

impl LocalizerRecipe for MosseParams {
    type Localizer = CorrelationLocalizer;

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<CorrelationLocalizer> {
        let spec = CorrelationSpec {
            window: self.window.clone(),
            label: spec::Label::Cells(self.label_sigma_px),
            learning_rate: self.learning_rate,
            first_samples: spec::FirstSamples {
                count: self.first_samples,
                turn_rad: self.first_turn_rad,
                resize: self.first_resize,
            },
            score: self.score.clone(),
            ..CorrelationSpec::new(FeatureKind::LogGray, FilterKind::Mosse { lambda: self.epsilon })
        };
        Ok(CorrelationLocalizer::new(spec, frame, &bbox))
    }
}

/// `mosse`. Its paper's own rule (`policy.model = "paper"`) takes a peak-to-sidelobe ratio below 7 for an occlusion.
pub fn mosse(name: &'static str) -> TrackerRecipe<MosseParams> {
    let groups = GroupParams {
        motion: MotionParams::sudden(),
        policy: PolicyParams {
            occluded_below: 0.35,
            seen_from: 0.45,
            found_from: 0.45,
            learn_from: 0.35,
            lost_after_s: 2.0,
            paper: PaperParams { psr_from: 7.0 },
            ..PolicyParams::default()
        },
        search: SearchParams::default(),
    };
    TrackerRecipe { name, localizer: MosseParams::default(), groups }
}
