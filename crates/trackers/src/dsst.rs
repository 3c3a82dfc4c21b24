//! Discriminative scale space tracking: `dsst` (danelljan2014) and `fdsst` (danelljan2017). One filter finds the place, a
//! second one, along scale, the size; `fdsst` compresses the features of the first.

use crate::correlation::filters::FilterKind;
use crate::correlation::{
    CorrelationLocalizer, CorrelationSpec, PeakParams, ScaleFilterParams, ScoreParams, Subpixel, WindowParams, spec,
};
use crate::features::FeatureKind;
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_tracking::motion::MotionParams;
use pursuit_tracking::policy::PolicyParams;
use pursuit_tracking::search::SearchParams;
use pursuit_tracking::{GroupParams, LocalizerRecipe, Result, TrackerRecipe};

pursuit_parameters::parameters! {
    /// Parameters of the scale space trackers.
    pub struct DsstParams {
        /// Channels that the features of the translation filter are compressed to; 0 leaves them as they are.
        pub dimensions: usize = 0, in 0..=32, source "danelljan2017, section 5.2: 18";
        /// Regularisation λ as a share of the mean energy of a frequency.
        pub lambda: f64 = 1e-3, in above(0.0), source "danelljan2014, section 5.1: 0.01; ours: 0.001";
        /// Standard deviation of the label as a share of √(width · height) of the target.
        pub label_sigma: f64 = 0.1, in above(0.0), source "danelljan2014, section 5.1: 1/16; ours: 0.1";
        /// Share of the new sample in the translation filter, η.
        pub learning_rate: f64 = 0.025, in 0.0..=1.0, source "danelljan2014, section 5.1: 0.025";
        /// The window.
        pub window: WindowParams = WindowParams {
            padding: 2.0,
            smallest_area_px: 6400.0,
            largest_area_px: 16384.0,
            ..WindowParams::default()
        };
        /// The filter along scale.
        pub scale: ScaleFilterParams = ScaleFilterParams {
            scales: 33,
            interpolate: false,
            label_sigma: 1.436,
            ..ScaleFilterParams::default()
        };
        /// The score, fitted as `docs/papers/dsst.md` says.
        pub score: ScoreParams =
            ScoreParams { bias: -4.7, collapse: 0.6, likeness: 2.8, first_colors: 5.1, ..ScoreParams::default() };
    }
}

impl DsstParams {
    /// The published `dsst`: the window twice the target, patches as they are; cells of two pixels, the smallest we make, in
    /// place of single pixels.
    pub fn danelljan2014() -> Self {
        Self {
            lambda: 0.01,
            label_sigma: 0.0625,
            window: WindowParams {
                padding: 1.0,
                cell_px: 2,
                smallest_area_px: 256.0,
                largest_area_px: 1e6,
                ..WindowParams::default()
            },
            scale: ScaleFilterParams { label_sigma: 1.436, ..ScaleFilterParams::danelljan2014() },
            ..Self::default()
        }
    }

    /// The published `fdsst`: patches as they are.
    pub fn danelljan2017() -> Self {
        Self {
            dimensions: 18,
            lambda: 0.01,
            label_sigma: 0.0625,
            window: WindowParams {
                padding: 2.0,
                smallest_area_px: 256.0,
                largest_area_px: 1e6,
                ..WindowParams::default()
            },
            scale: ScaleFilterParams::danelljan2017(),
            ..Self::default()
        }
    }
}

impl LocalizerRecipe for DsstParams {
    type Localizer = CorrelationLocalizer;

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<CorrelationLocalizer> {
        let (dimensions, lambda) = (self.dimensions, self.lambda);
        let (filter, subpixel) = if dimensions > 0 {
            (FilterKind::Compressed { dimensions, lambda }, Subpixel::Series)
        } else {
            (FilterKind::Mosse { lambda }, Subpixel::Parabola)
        };
        let spec = CorrelationSpec {
            window: self.window.clone(),
            label: spec::Label::OfTarget(self.label_sigma),
            learning_rate: self.learning_rate,
            scale: Some(self.scale.clone()),
            peaks: PeakParams { subpixel, ..PeakParams::default() },
            score: self.score.clone(),
            ..CorrelationSpec::new(FeatureKind::HogGray, filter)
        };
        Ok(CorrelationLocalizer::new(spec, frame, &bbox))
    }
}

fn recipe(name: &'static str, localizer: DsstParams) -> TrackerRecipe<DsstParams> {
    let groups = GroupParams {
        motion: MotionParams::sudden(),
        policy: PolicyParams::default(),
        search: SearchParams::default(),
    };
    TrackerRecipe { name, localizer, groups }
}

/// `dsst`.
pub fn dsst(name: &'static str) -> TrackerRecipe<DsstParams> {
    recipe(name, DsstParams::default())
}

/// `fdsst`: features compressed, half as many sizes, interpolated; learns a little more slowly.
pub fn fdsst(name: &'static str) -> TrackerRecipe<DsstParams> {
    let scale = ScaleFilterParams { learning_rate: 0.018, ..ScaleFilterParams::default() };
    recipe(name, DsstParams { dimensions: 18, learning_rate: 0.018, scale, ..DsstParams::default() })
}
