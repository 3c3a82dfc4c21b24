//! Kernelized correlation filters: `kcf`, `kcf-fixed` and, on depth, `kcf-depth` (henriques2015; sizes as in li2014), and
//! `csk` (henriques2012).

mod presets;

pub use presets::{csk, kcf_depth, kcf_fixed};

use crate::correlation::filters::{FilterKind, Kernel};
use crate::correlation::{CorrelationLocalizer, CorrelationSpec, ScaleLadderParams, ScoreParams, WindowParams, spec};
use crate::features::FeatureKind;
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_tracking::motion::MotionParams;
use pursuit_tracking::policy::PolicyParams;
use pursuit_tracking::search::SearchParams;
use pursuit_tracking::{GroupParams, LocalizerRecipe, Result, TrackerRecipe};

pursuit_parameters::choices! {
    /// What the filter looks at.
    pub enum KcfFeatures {
        /// Histograms of oriented gradients.
        Hog = "hog",
        /// Grey values.
        Gray = "gray",
        /// Histograms of oriented gradients of inverse depth; of frames without depth, of grey.
        DepthHog = "depth-hog",
        /// Those of depth, and those of the picture beside them.
        FusedHog = "fused-hog",
    }
}

pursuit_parameters::choices! {
    /// Which kernel compares patches.
    pub enum KernelKind {
        /// A Gaussian of the distance.
        Gaussian = "gaussian",
        /// A power of the inner product.
        Polynomial = "polynomial",
        /// The inner product: the dual correlation filter of henriques2015.
        Linear = "linear",
    }
}

pursuit_parameters::parameters! {
    /// Parameters of the kernelized correlation filters.
    pub struct KcfParams {
        /// What the filter looks at.
        pub features: KcfFeatures = KcfFeatures::Hog;
        /// On depth: the distance whose inverse is the greatest value. Nearer than this sensors of this kind do not see.
        pub nearest_mm: usize = 400, in 1..=65_535, unit "mm", source "ours";
        /// Which kernel compares patches.
        pub kernel: KernelKind = KernelKind::Gaussian;
        /// Bandwidth σ of the Gaussian kernel.
        pub kernel_sigma: f64 = 0.5, in above(0.0), source "henriques2015, section 8: 0.5 for HOG, 0.2 for grey";
        /// Additive term a of the polynomial kernel.
        pub kernel_offset: f64 = 1.0, in Bounds::default(), source "henriques2015, eq. 29; released code: 1";
        /// Exponent b of the polynomial kernel.
        pub kernel_power: f64 = 9.0, in above(0.0), source "henriques2015, eq. 29; released code: 9 for HOG, 7 for grey";
        /// Regularisation λ.
        pub lambda: f64 = 1e-4, in above(0.0), source "henriques2015, eq. 17, section 8: 1e-4";
        /// Standard deviation of the label as a share of √(width · height) of the target.
        pub label_sigma: f64 = 0.1, in above(0.0), source "henriques2015, section 8: 0.1";
        /// Share of the new appearance per frame.
        pub learning_rate: f64 = 0.02, in 0.0..=1.0, source "henriques2015, section 8: 0.02 for HOG, 0.075 for grey";
        /// The window.
        pub window: WindowParams = WindowParams { padding: 2.0, ..WindowParams::default() };
        /// Sizes tried.
        pub scale_ladder: ScaleLadderParams = ScaleLadderParams { levels: 1, ..ScaleLadderParams::default() };
        /// The score, fitted as `docs/papers/kcf.md` says.
        pub score: ScoreParams =
            ScoreParams { bias: -2.0, psr: 0.22, collapse: 1.3, likeness: 7.7, ..ScoreParams::default() };
    }
    renamed { "scale" => ["scale_ladder"] }
}

impl KcfParams {
    pub(crate) fn spec(&self) -> CorrelationSpec {
        let features = match self.features {
            KcfFeatures::Hog => FeatureKind::Hog,
            KcfFeatures::Gray => FeatureKind::Gray,
            KcfFeatures::DepthHog => self.depth_features(false),
            KcfFeatures::FusedHog => self.depth_features(true),
        };
        let kernel = match self.kernel {
            KernelKind::Linear => Kernel::Linear,
            KernelKind::Polynomial => Kernel::Polynomial { offset: self.kernel_offset, power: self.kernel_power },
            KernelKind::Gaussian => Kernel::Gaussian { sigma: self.kernel_sigma },
        };
        CorrelationSpec {
            window: self.window.clone(),
            label: spec::Label::OfTarget(self.label_sigma),
            learning_rate: self.learning_rate,
            ladder: self.scale_ladder.clone(),
            score: self.score.clone(),
            ..CorrelationSpec::new(features, FilterKind::Kernel { kernel, lambda: self.lambda })
        }
    }
}

impl KcfParams {
    fn depth_features(&self, fused: bool) -> FeatureKind {
        FeatureKind::DepthHog { fused, nearest_mm: u16::try_from(self.nearest_mm).unwrap_or(u16::MAX) }
    }
}

impl LocalizerRecipe for KcfParams {
    type Localizer = CorrelationLocalizer;

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<CorrelationLocalizer> {
        Ok(CorrelationLocalizer::new(self.spec(), frame, &bbox))
    }
}

fn groups(policy: PolicyParams) -> GroupParams {
    GroupParams {
        motion: MotionParams::sudden(),
        policy,
        search: SearchParams { wide_windows: 6, ..SearchParams::default() },
    }
}

/// `kcf`: on HOG, with a search over sizes.
pub fn kcf(name: &'static str) -> TrackerRecipe<KcfParams> {
    let policy = PolicyParams { seen_from: 0.6, found_from: 0.6, ..PolicyParams::default() };
    let mut groups = groups(policy);
    groups.search = SearchParams { wide_windows: 6, ..SearchParams::at_last_place() };
    TrackerRecipe { name, localizer: KcfParams::default(), groups }
}
