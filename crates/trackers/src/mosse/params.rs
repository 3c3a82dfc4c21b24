use crate::correlation::Calibration;

crate::parameters! {
    /// Parameters of the filter of minimum output sum of squared error (bolme2010).
    pub struct MosseParams for "mosse" {
        /// How much larger the window is than the target: surroundings as a multiple of its size, `[0, 4]`.
        pub padding: f64 = 1.5,
        /// Standard deviation of the wanted response in patch pixels (σ, section 3.2: 2), > 0.
        pub label_sigma_px: f64 = 2.0,
        /// Share of the new frame in the filter (η, eqs. 10–12: 0.125), `[0, 1]`.
        pub learning_rate: f64 = 0.125,
        /// First samples: the target as it is and small random warps of it (section 3.3: 8), 1 to 64.
        pub first_samples: usize = 8,
        /// Regularisation ε as a share of the mean energy of a frequency (section 3.3), > 0.
        pub epsilon: f64 = 0.1,
        /// Smallest area of the patch in pixels: windows of smaller targets are enlarged, > 0.
        pub smallest_area_px: f64 = 1024.0,
        /// Largest area of the patch in pixels: windows of larger targets are shrunk (section 4: 64 × 64), > 0.
        pub largest_area_px: f64 = 4096.0,
        /// How suddenly the target moves: spectral density of its acceleration in sizes² per s³, > 0.
        pub acceleration: f64 = 300.0,
        /// Below this confidence the target counts as occluded and nothing is learned, `[0, 1]`.
        pub occluded_below: f64 = 0.35,
        /// An occluded target is seen again from this confidence, `[0, 1]`.
        pub seen_from: f64 = 0.45,
        /// Appearance is learned from this confidence, `[0, 1]`.
        pub learn_from: f64 = 0.35,
        /// A target occluded for longer is lost and searched for all over, seconds, > 0.
        pub lost_after_s: f64 = 2.0,
    }
    validate(self) {
        let check = |name: &str, fine: bool, range: &str| if fine { Ok(()) } else { Err(Self::reject(name, range)) };
        let unit = |v: f64| (0.0..=1.0).contains(&v);
        let positive = |v: f64| v > 0.0 && v.is_finite();
        check("padding", (0.0..=4.0).contains(&self.padding), "must be between 0 and 4")?;
        check("label_sigma_px", positive(self.label_sigma_px), "must be above 0")?;
        check("learning_rate", (0.0..=1.0).contains(&self.learning_rate), "must be between 0 and 1")?;
        check("first_samples", (1..=64).contains(&self.first_samples), "must be between 1 and 64")?;
        check("epsilon", positive(self.epsilon), "must be above 0")?;
        let areas = 256.0..=1e6;
        check("smallest_area_px", areas.contains(&self.smallest_area_px), "must be between 256 and a million")?;
        let largest = areas.contains(&self.largest_area_px) && self.largest_area_px >= self.smallest_area_px;
        check("largest_area_px", largest, "must be between smallest_area_px and a million")?;
        check("acceleration", positive(self.acceleration), "must be above 0")?;
        check("occluded_below", unit(self.occluded_below), "must be between 0 and 1")?;
        check("seen_from", unit(self.seen_from), "must be between 0 and 1")?;
        check("learn_from", unit(self.learn_from), "must be between 0 and 1")?;
        check("lost_after_s", positive(self.lost_after_s), "must be above 0")?;
    }
}

impl MosseParams {
    /// What the response's figures say of the box, fitted by logistic regression to the overlap with the truth on real
    /// sequences, each sequence weighing the same.
    pub(super) const CALIBRATION: Calibration = Calibration { bias: -1.9, psr: 0.0, collapse: 1.8, first_view: 4.5 };
}
