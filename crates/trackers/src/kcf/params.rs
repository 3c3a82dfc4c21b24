use crate::correlation::Calibration;
use serde::{Deserialize, Serialize};

/// What the filter looks at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum KcfFeatureKind {
    /// Grey values.
    Gray,
    /// Histograms of oriented gradients.
    Hog,
}

/// Which kernel compares patches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum KernelKind {
    /// The inner product: the dual correlation filter of henriques2015.
    Linear,
    /// A power of it.
    Polynomial,
    /// A Gaussian of the distance.
    Gaussian,
}

crate::parameters! {
    /// Parameters of the kernelized correlation filter with a search over sizes (henriques2015; sizes as in SAMF, li2014).
    pub struct KcfParams for "kcf" {
        /// `hog` or `gray`.
        pub features: KcfFeatureKind = KcfFeatureKind::Hog,
        /// Side of a HOG cell in patch pixels (henriques2015, section 8: 4), 2 to 16.
        pub cell_px: usize = 4,
        /// How much larger the window is than the target: surroundings as a multiple of its size (section 8: 1.5), `[0, 4]`.
        pub padding: f64 = 2.0,
        /// `gaussian`, `polynomial` or `linear`.
        pub kernel: KernelKind = KernelKind::Gaussian,
        /// Bandwidth σ of the Gaussian kernel (section 8: 0.5 for HOG, 0.2 for grey), > 0.
        pub kernel_sigma: f64 = 0.5,
        /// Additive term a of the polynomial kernel (eq. 29; 1 in the released code).
        pub kernel_offset: f64 = 1.0,
        /// Exponent b of the polynomial kernel (eq. 29; 9 for HOG, 7 for grey in the released code), > 0.
        pub kernel_power: f64 = 9.0,
        /// Regularisation λ (eq. 17; section 8: 1e-4), > 0.
        pub lambda: f64 = 1e-4,
        /// Standard deviation of the label as a share of √(width · height) of the target (section 8: 0.1), > 0.
        pub label_sigma: f64 = 0.1,
        /// Share of the new appearance per frame (section 8: 0.02 for HOG, 0.075 for grey), `[0, 1]`.
        pub learning_rate: f64 = 0.02,
        /// Smallest area of the patch in pixels: windows of smaller targets are enlarged, > 0.
        pub smallest_area_px: f64 = 2500.0,
        /// Largest area of the patch in pixels: windows of larger targets are shrunk, > 0.
        pub largest_area_px: f64 = 9216.0,
        /// Sizes tried on either side of the last one: 0 keeps the size, at most 8.
        pub scale_levels: usize = 1,
        /// Ratio of neighbouring sizes, `(1, 2]`.
        pub scale_step: f64 = 1.05,
        /// What responses at another than the last size are multiplied by, `(0, 1]`.
        pub scale_penalty: f64 = 0.95,
        /// How suddenly the target moves: spectral density of its acceleration in sizes² per s³, > 0.
        pub acceleration: f64 = 300.0,
        /// Below this confidence the target counts as occluded and nothing is learned, `[0, 1]`.
        pub occluded_below: f64 = 0.4,
        /// An occluded target is seen again from this confidence, `[0, 1]`.
        pub seen_from: f64 = 0.6,
        /// Appearance is learned from this confidence, `[0, 1]`.
        pub learn_from: f64 = 0.4,
        /// A target occluded for longer is lost and searched for all over, seconds, > 0.
        pub lost_after_s: f64 = 1.0,
    }
    validate(self) {
        let check = |name: &str, fine: bool, range: &str| if fine { Ok(()) } else { Err(Self::reject(name, range)) };
        let unit = |v: f64| (0.0..=1.0).contains(&v);
        let positive = |v: f64| v > 0.0 && v.is_finite();
        check("cell_px", (2..=16).contains(&self.cell_px), "must be between 2 and 16")?;
        check("padding", (0.0..=4.0).contains(&self.padding), "must be between 0 and 4")?;
        check("kernel_sigma", positive(self.kernel_sigma), "must be above 0")?;
        check("kernel_offset", self.kernel_offset.is_finite(), "must be a finite number")?;
        check("kernel_power", positive(self.kernel_power), "must be above 0")?;
        check("lambda", positive(self.lambda), "must be above 0")?;
        check("label_sigma", positive(self.label_sigma), "must be above 0")?;
        check("learning_rate", unit(self.learning_rate), "must be between 0 and 1")?;
        let areas = 256.0..=1e6;
        check("smallest_area_px", areas.contains(&self.smallest_area_px), "must be between 256 and a million")?;
        let largest = areas.contains(&self.largest_area_px) && self.largest_area_px >= self.smallest_area_px;
        check("largest_area_px", largest, "must be between smallest_area_px and a million")?;
        check("scale_levels", self.scale_levels <= 8, "must be at most 8")?;
        check("scale_step", self.scale_step > 1.0 && self.scale_step <= 2.0, "must be above 1 and at most 2")?;
        check("scale_penalty", self.scale_penalty > 0.0 && unit(self.scale_penalty), "must be above 0 and at most 1")?;
        check("acceleration", positive(self.acceleration), "must be above 0")?;
        check("occluded_below", unit(self.occluded_below), "must be between 0 and 1")?;
        check("seen_from", unit(self.seen_from), "must be between 0 and 1")?;
        check("learn_from", unit(self.learn_from), "must be between 0 and 1")?;
        check("lost_after_s", positive(self.lost_after_s), "must be above 0")?;
    }
}

impl KcfParams {
    /// What the response's figures say of the box, fitted by logistic regression to the overlap with the truth on real
    /// sequences, each sequence weighing the same.
    pub(super) const fn calibration(&self) -> Calibration {
        match (self.features, self.scale_levels) {
            (KcfFeatureKind::Gray, _) => Calibration { bias: -1.9, psr: 0.05, collapse: 1.5, first_view: 3.6 },
            (KcfFeatureKind::Hog, 0) => Calibration { bias: -1.8, psr: 0.17, collapse: 1.25, first_view: 7.1 },
            (KcfFeatureKind::Hog, _) => Calibration { bias: -2.0, psr: 0.22, collapse: 1.3, first_view: 7.7 },
        }
    }

    /// The published tracker on HOG (henriques2015, section 8 and the released code): fixed size, patch at full resolution up
    /// to a target of 100 × 100 pixels.
    pub fn henriques2015_hog() -> Self {
        Self { padding: 1.5, largest_area_px: 62_500.0, smallest_area_px: 256.0, scale_levels: 0, ..Self::default() }
    }

    /// The published tracker on grey values.
    pub fn henriques2015_gray() -> Self {
        Self {
            features: KcfFeatureKind::Gray,
            kernel_sigma: 0.2,
            kernel_power: 7.0,
            learning_rate: 0.075,
            ..Self::henriques2015_hog()
        }
    }

    /// The circulant structure tracker (henriques2012): grey values, λ = 0.01, label of 1/16.
    pub fn henriques2012() -> Self {
        Self { padding: 1.0, lambda: 0.01, label_sigma: 1.0 / 16.0, ..Self::henriques2015_gray() }
    }
}

crate::parameters! {
    /// Parameters of the kernelized correlation filter on HOG of fixed size (henriques2015).
    pub struct KcfFixedParams for "kcf-fixed" {
        /// How much larger the window is than the target: surroundings as a multiple of its size (section 8: 1.5), `[0, 4]`.
        pub padding: f64 = 2.0,
        /// Bandwidth σ of the Gaussian kernel (section 8: 0.5), > 0.
        pub kernel_sigma: f64 = 0.5,
        /// Regularisation λ (eq. 17; section 8: 1e-4), > 0.
        pub lambda: f64 = 1e-4,
        /// Standard deviation of the label as a share of √(width · height) of the target (section 8: 0.1), > 0.
        pub label_sigma: f64 = 0.1,
        /// Share of the new appearance per frame (section 8: 0.02), `[0, 1]`.
        pub learning_rate: f64 = 0.02,
        /// Largest area of the patch in pixels: windows of larger targets are shrunk, > 0.
        pub largest_area_px: f64 = 9216.0,
        /// Below this confidence the target counts as occluded and nothing is learned, `[0, 1]`.
        pub occluded_below: f64 = 0.3,
        /// An occluded target is seen again from this confidence, `[0, 1]`.
        pub seen_from: f64 = 0.6,
        /// Appearance is learned from this confidence, `[0, 1]`.
        pub learn_from: f64 = 0.3,
        /// A target occluded for longer is lost and searched for all over, seconds, > 0.
        pub lost_after_s: f64 = 1.0,
    }
    validate(self) {
        KcfParams::from(self).validate()?;
    }
}

impl From<&KcfFixedParams> for KcfParams {
    fn from(p: &KcfFixedParams) -> Self {
        Self {
            padding: p.padding,
            kernel_sigma: p.kernel_sigma,
            lambda: p.lambda,
            label_sigma: p.label_sigma,
            learning_rate: p.learning_rate,
            largest_area_px: p.largest_area_px,
            scale_levels: 0,
            occluded_below: p.occluded_below,
            seen_from: p.seen_from,
            learn_from: p.learn_from,
            lost_after_s: p.lost_after_s,
            ..Self::default()
        }
    }
}

crate::parameters! {
    /// Parameters of the circulant structure tracker on grey values (henriques2012).
    pub struct CskParams for "csk" {
        /// How much larger the window is than the target: surroundings as a multiple of its size (henriques2012: 1), `[0, 4]`.
        pub padding: f64 = 1.5,
        /// Bandwidth σ of the Gaussian kernel (henriques2012: 0.2), > 0.
        pub kernel_sigma: f64 = 0.2,
        /// Regularisation λ (henriques2012: 0.01), > 0.
        pub lambda: f64 = 0.01,
        /// Standard deviation of the label as a share of √(width · height) of the target (henriques2012: 1/16), > 0.
        pub label_sigma: f64 = 0.0625,
        /// Share of the new appearance per frame (henriques2012: 0.075), `[0, 1]`.
        pub learning_rate: f64 = 0.075,
        /// Largest area of the patch in pixels: windows of larger targets are shrunk, > 0.
        pub largest_area_px: f64 = 4096.0,
        /// Below this confidence the target counts as occluded and nothing is learned, `[0, 1]`.
        pub occluded_below: f64 = 0.3,
        /// An occluded target is seen again from this confidence, `[0, 1]`.
        pub seen_from: f64 = 0.4,
        /// Appearance is learned from this confidence, `[0, 1]`.
        pub learn_from: f64 = 0.3,
        /// A target occluded for longer is lost and searched for all over, seconds, > 0.
        pub lost_after_s: f64 = 2.0,
    }
    validate(self) {
        KcfParams::from(self).validate()?;
    }
}

impl From<&CskParams> for KcfParams {
    fn from(p: &CskParams) -> Self {
        Self {
            padding: p.padding,
            kernel_sigma: p.kernel_sigma,
            lambda: p.lambda,
            label_sigma: p.label_sigma,
            learning_rate: p.learning_rate,
            smallest_area_px: 1024.0,
            largest_area_px: p.largest_area_px,
            occluded_below: p.occluded_below,
            seen_from: p.seen_from,
            learn_from: p.learn_from,
            lost_after_s: p.lost_after_s,
            ..Self::henriques2012()
        }
    }
}
