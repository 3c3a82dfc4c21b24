use crate::correlation::Calibration;

crate::parameters! {
    /// Parameters of the sum of template and pixel-wise learners (bertinetto2016): HOG correlation beside a colour histogram.
    pub struct StapleParams for "staple" {
        /// How much larger the window is than the target: surroundings as a multiple of its size, `[0.5, 4]`.
        pub padding: f64 = 2.0,
        /// Side of a HOG cell in patch pixels (released code: 4), 2 to 16.
        pub cell_px: usize = 4,
        /// Smallest area of the patch in pixels: windows of smaller targets are enlarged, > 0.
        pub smallest_area_px: f64 = 6400.0,
        /// Largest area of the patch in pixels (released code: 150 × 150), > 0.
        pub largest_area_px: f64 = 16384.0,
        /// Regularisation of the template as a share of the mean energy of a frequency (λ, section 4.2), > 0.
        pub lambda: f64 = 1e-3,
        /// Standard deviation of the label as a share of √(width · height) of the target (released code: 1/16), > 0.
        pub label_sigma: f64 = 0.0625,
        /// Share of the new template per frame (η_tmpl, table 1: 0.01; the measured best is a little higher), `[0, 1]`.
        pub learning_rate: f64 = 0.015,
        /// Share of the new histograms per frame (η_hist, table 1: 0.04), `[0, 1]`.
        pub color_learning_rate: f64 = 0.04,
        /// Weight of the colour response beside the template's (α, section 3.1: 0.3), `[0, 1]`.
        pub color_share: f64 = 0.3,
        /// The target's colours are learned from its box less this share on each side (released code: 0.2 of the mean side in
        /// all), `[0, 0.4]`.
        pub inner_margin: f64 = 0.1,
        /// Sizes sampled by the filter along scale (danelljan2017: 17); odd, at most 63; 1 keeps the size.
        pub scales: usize = 17,
        /// Ratio of neighbouring sizes after interpolation to twice as many (danelljan2017: 1.02), `(1, 1.2]`.
        pub scale_step: f64 = 1.02,
        /// Standard deviation of the scale label in sampled sizes, > 0.
        pub scale_label_sigma: f64 = 1.0,
        /// Share of a new sample in the scale filter (danelljan2014: 0.025), `[0, 1]`.
        pub scale_learning_rate: f64 = 0.025,
        /// Regularisation of the scale filter (danelljan2014: 0.01), > 0.
        pub scale_lambda: f64 = 0.01,
        /// Largest area of a sample of the scale filter in pixels (danelljan2014: 512), `[64, 65536]`.
        pub scale_area_px: f64 = 1024.0,
        /// How suddenly the target moves: spectral density of its acceleration in sizes² per s³, > 0.
        pub acceleration: f64 = 300.0,
        /// Below this confidence the target counts as occluded and nothing is learned, `[0, 1]`.
        pub occluded_below: f64 = 0.4,
        /// An occluded target is seen again from this confidence, `[0, 1]`.
        pub seen_from: f64 = 0.5,
        /// Appearance is learned from this confidence, `[0, 1]`.
        pub learn_from: f64 = 0.4,
        /// A target occluded for longer is lost and searched for all over, seconds, > 0.
        pub lost_after_s: f64 = 1.0,
    }
    validate(self) {
        let check = |name: &str, fine: bool, range: &str| if fine { Ok(()) } else { Err(Self::reject(name, range)) };
        let unit = |v: f64| (0.0..=1.0).contains(&v);
        let positive = |v: f64| v > 0.0 && v.is_finite();
        check("padding", (0.5..=4.0).contains(&self.padding), "must be between 0.5 and 4")?;
        check("cell_px", (2..=16).contains(&self.cell_px), "must be between 2 and 16")?;
        let areas = 256.0..=1e6;
        check("smallest_area_px", areas.contains(&self.smallest_area_px), "must be between 256 and a million")?;
        let largest = areas.contains(&self.largest_area_px) && self.largest_area_px >= self.smallest_area_px;
        check("largest_area_px", largest, "must be between smallest_area_px and a million")?;
        check("lambda", positive(self.lambda), "must be above 0")?;
        check("label_sigma", positive(self.label_sigma), "must be above 0")?;
        check("learning_rate", unit(self.learning_rate), "must be between 0 and 1")?;
        check("color_learning_rate", unit(self.color_learning_rate), "must be between 0 and 1")?;
        check("color_share", unit(self.color_share), "must be between 0 and 1")?;
        check("inner_margin", (0.0..=0.4).contains(&self.inner_margin), "must be between 0 and 0.4")?;
        check("scales", self.scales % 2 == 1 && self.scales <= 63, "must be odd and at most 63")?;
        check("scale_step", self.scale_step > 1.0 && self.scale_step <= 1.2, "must be above 1 and at most 1.2")?;
        check("scale_label_sigma", positive(self.scale_label_sigma), "must be above 0")?;
        check("scale_learning_rate", unit(self.scale_learning_rate), "must be between 0 and 1")?;
        check("scale_lambda", positive(self.scale_lambda), "must be above 0")?;
        check("scale_area_px", (64.0..=65_536.0).contains(&self.scale_area_px), "must be between 64 and 65536")?;
        check("acceleration", positive(self.acceleration), "must be above 0")?;
        check("occluded_below", unit(self.occluded_below), "must be between 0 and 1")?;
        check("seen_from", unit(self.seen_from), "must be between 0 and 1")?;
        check("learn_from", unit(self.learn_from), "must be between 0 and 1")?;
        check("lost_after_s", positive(self.lost_after_s), "must be above 0")?;
    }
}

impl StapleParams {
    /// What the response's figures say of the box, fitted by logistic regression to the overlap with the truth on real
    /// sequences, each sequence weighing the same.
    pub(super) const CALIBRATION: Calibration = Calibration { bias: -2.0, psr: 1.05, collapse: 1.3, first_view: 6.3 };
}
