use crate::Result;
use crate::correlation::Calibration;
use crate::parameters::Parameters;
use crate::scale::ScaleSettings;

crate::parameters! {
    /// Parameters of the discriminative scale space tracker (danelljan2014).
    pub struct DsstParams for "dsst" {
        /// How much larger the window is than the target: surroundings as a multiple of its size (section 5.1: 1), `[0.5, 4]`.
        pub padding: f64 = 2.0,
        /// Side of a feature cell in patch pixels (section 5.1: 1), 2 to 16.
        pub cell_px: usize = 4,
        /// Smallest area of the patch in pixels: windows of smaller targets are enlarged, > 0.
        pub smallest_area_px: f64 = 6400.0,
        /// Largest area of the patch in pixels: windows of larger targets are shrunk, > 0.
        pub largest_area_px: f64 = 16384.0,
        /// Regularisation λ (eq. 3; section 5.1: 0.01) as a share of the mean energy of a frequency, > 0.
        pub lambda: f64 = 1e-3,
        /// Standard deviation of the label as a share of √(width · height) of the target (section 5.1: 1/16), > 0.
        pub label_sigma: f64 = 0.1,
        /// Share of the new sample in both filters, η (eq. 5; section 5.1: 0.025), `[0, 1]`.
        pub learning_rate: f64 = 0.025,
        /// Sizes sampled, S (section 5.1: 33), odd, 3 to 63.
        pub scales: usize = 33,
        /// Ratio of neighbouring sizes, a (section 5.1: 1.02), `(1, 1.2]`.
        pub scale_step: f64 = 1.02,
        /// Standard deviation of the scale label in sizes (released code: √33 / 4), > 0.
        pub scale_label_sigma: f64 = 1.436,
        /// Largest area of a sample of the scale filter in pixels (released code: 512), `[64, 65536]`.
        pub scale_area_px: f64 = 1024.0,
    }
    validate(self) {
        self.common().validate::<Self>()?;
    }
}

crate::parameters! {
    /// Parameters of the fast discriminative scale space tracker (danelljan2017).
    pub struct FdsstParams for "fdsst" {
        /// How much larger the window is than the target: surroundings as a multiple of its size (section 5.2: 2), `[0.5, 4]`.
        pub padding: f64 = 2.0,
        /// Side of a feature cell in patch pixels (section 5.2: 4), 2 to 16.
        pub cell_px: usize = 4,
        /// Smallest area of the patch in pixels: windows of smaller targets are enlarged, > 0.
        pub smallest_area_px: f64 = 6400.0,
        /// Largest area of the patch in pixels: windows of larger targets are shrunk, > 0.
        pub largest_area_px: f64 = 16384.0,
        /// Channels that the features of the translation filter are compressed to (section 5.2: 18), 1 to 32.
        pub dimensions: usize = 18,
        /// Regularisation λ (section 5.2: 0.01) as a share of the mean energy of a frequency, > 0.
        pub lambda: f64 = 1e-3,
        /// Standard deviation of the label as a share of √(width · height) of the target (section 5.2: 1/16), > 0.
        pub label_sigma: f64 = 0.1,
        /// Share of the new sample in both filters, η (section 5.2: 0.025), `[0, 1]`.
        pub learning_rate: f64 = 0.018,
        /// Sizes sampled (section 5.2: 17), interpolated to about twice as many; odd, 3 to 63.
        pub scales: usize = 17,
        /// Ratio of neighbouring sizes after interpolation, a (section 5.2: 1.02), `(1, 1.2]`.
        pub scale_step: f64 = 1.02,
        /// Standard deviation of the scale label in sampled sizes (section 5.2: 1/16 of their number), > 0.
        pub scale_label_sigma: f64 = 1.0625,
        /// Largest area of a sample of the scale filter in pixels (section 5.2: 512), `[64, 65536]`.
        pub scale_area_px: f64 = 1024.0,
    }
    validate(self) {
        self.common().validate::<Self>()?;
        if !(1..=super::CHANNELS).contains(&self.dimensions) {
            return Err(Self::reject("dimensions", "must be between 1 and 32"));
        }
    }
}

/// What scores are made of, fitted as `docs/papers/dsst.md` says.
pub(super) const CALIBRATION: Calibration = Calibration { bias: -0.8, psr: 0.0, collapse: 1.4, first_view: 6.2 };

impl DsstParams {
    /// The published tracker: the window twice the target, patches as they are; cells of two pixels, the smallest we make, in
    /// place of single pixels.
    pub fn danelljan2014() -> Self {
        Self {
            padding: 1.0,
            cell_px: 2,
            smallest_area_px: 256.0,
            largest_area_px: 1e6,
            lambda: 0.01,
            label_sigma: 0.0625,
            scale_area_px: 512.0,
            ..Self::default()
        }
    }

    pub(super) fn common(&self) -> Common {
        Common {
            padding: self.padding,
            cell_px: self.cell_px,
            area_px: (self.smallest_area_px, self.largest_area_px),
            lambda: self.lambda,
            label_sigma: self.label_sigma,
            learning_rate: self.learning_rate,
            scale: ScaleSettings {
                scales: self.scales,
                interpolated: self.scales,
                step: self.scale_step,
                label_sigma: self.scale_label_sigma,
                learning_rate: self.learning_rate,
                area_px: self.scale_area_px,
                ..ScaleSettings::danelljan2014()
            },
        }
    }
}

impl FdsstParams {
    /// The published tracker: patches as they are.
    pub fn danelljan2017() -> Self {
        Self {
            smallest_area_px: 256.0,
            largest_area_px: 1e6,
            lambda: 0.01,
            learning_rate: 0.025,
            label_sigma: 0.0625,
            scale_area_px: 512.0,
            ..Self::default()
        }
    }

    pub(super) fn common(&self) -> Common {
        Common {
            padding: self.padding,
            cell_px: self.cell_px,
            area_px: (self.smallest_area_px, self.largest_area_px),
            lambda: self.lambda,
            label_sigma: self.label_sigma,
            learning_rate: self.learning_rate,
            scale: ScaleSettings {
                scales: self.scales,
                interpolated: 2 * self.scales - 1,
                step: self.scale_step,
                label_sigma: self.scale_label_sigma,
                learning_rate: self.learning_rate,
                area_px: self.scale_area_px,
                ..ScaleSettings::danelljan2017()
            },
        }
    }
}

/// What both have.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct Common {
    pub padding: f64,
    pub cell_px: usize,
    pub area_px: (f64, f64),
    pub lambda: f64,
    pub label_sigma: f64,
    pub learning_rate: f64,
    pub scale: ScaleSettings,
}

impl Common {
    fn validate<P: Parameters>(&self) -> Result<()> {
        let check = |name: &str, fine: bool, range: &str| if fine { Ok(()) } else { Err(P::reject(name, range)) };
        let positive = |v: f64| v > 0.0 && v.is_finite();
        let areas = 256.0..=1e6;
        let (smallest, largest) = self.area_px;
        check("padding", (0.5..=4.0).contains(&self.padding), "must be between 0.5 and 4")?;
        check("cell_px", (2..=16).contains(&self.cell_px), "must be between 2 and 16")?;
        check("smallest_area_px", areas.contains(&smallest), "must be between 256 and a million")?;
        let ordered = areas.contains(&largest) && largest >= smallest;
        check("largest_area_px", ordered, "must be between smallest_area_px and a million")?;
        check("lambda", positive(self.lambda), "must be above 0")?;
        check("label_sigma", positive(self.label_sigma), "must be above 0")?;
        check("learning_rate", (0.0..=1.0).contains(&self.learning_rate), "must be between 0 and 1")?;
        let scale = &self.scale;
        check("scales", scale.scales % 2 == 1 && (3..=63).contains(&scale.scales), "must be odd, 3 to 63")?;
        check("scale_step", scale.step > 1.0 && scale.step <= 1.2, "must be above 1 and at most 1.2")?;
        check("scale_label_sigma", positive(scale.label_sigma), "must be above 0")?;
        check("scale_area_px", (64.0..=65_536.0).contains(&scale.area_px), "must be between 64 and 65536")
    }
}
