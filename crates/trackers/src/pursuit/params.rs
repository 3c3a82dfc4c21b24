crate::parameters! {
    /// Parameters of the default tracker. What is not said to be ours is that of the paper it names.
    pub struct PursuitParams for "pursuit" {
        /// Side of a feature cell in patch pixels (galoogahi2017, section 4: 4), 2 to 16.
        pub cell_px: usize = 4,
        /// Cells along a side of the window (galoogahi2017: 50; ours: 40, as accurate and faster), an even number of the
        /// form 2ᵃ3ᵇ5ᶜ is fastest, 16 to 128.
        pub cells: usize = 40,
        /// Side of the window as a multiple of the side of a square as large as the target (galoogahi2017, released code: 5),
        /// 2 to 8.
        pub search: f64 = 5.0,
        /// Standard deviation of the label as a share of the target's side (galoogahi2017, section 4: 1/16), `(0, 1)`.
        pub label_sigma: f64 = 0.0625,
        /// Share of the new sample per frame, η (galoogahi2017, section 4: 0.013), `[0, 1]`.
        pub learning_rate: f64 = 0.013,
        /// First penalty of the alternating directions (galoogahi2017, section 4: 1), > 0.
        pub penalty: f64 = 1.0,
        /// Growth of the penalty per iteration (galoogahi2017, section 4: 10), 1 to 1000.
        pub penalty_growth: f64 = 10.0,
        /// Iterations per frame (galoogahi2017, section 4: 2), 1 to 10.
        pub iterations: usize = 2,
        /// Share of the new sample in the scale filter per frame (danelljan2017, section 5.2: 0.025), `[0, 1]`.
        pub scale_learning_rate: f64 = 0.025,
        /// Largest area of a scale sample in pixels (danelljan2017: 512; ours: 1024), 64 to 16384.
        pub scale_area_px: f64 = 1024.0,
        /// Changes of the size of a target with this side (square root of its area) in pixels or less are not believed (ours),
        /// ≥ 0.
        pub size_kept_px: f64 = 8.0,
        /// Changes of the size of a target with this side in pixels or more are believed in full, in between in part (ours),
        /// above `size_kept_px`.
        pub size_followed_px: f64 = 24.0,
        /// Peaks of a response that are looked at; the likeliest is believed (ours), 1 to 16.
        pub candidates: usize = 3,
        /// Least height of a further peak as a share of the highest (ours), `[0, 1]`.
        pub runner_up: f64 = 0.5,
        /// Share of the box left out on each side when its colours are learned (bertinetto2016, released code: 0.2 of the mean
        /// side in all), `[0, 0.4]`.
        pub color_inner_margin: f64 = 0.1,
        /// Share of the new colours per frame (bertinetto2016, table 1: 0.04), `[0, 1]`.
        pub color_learning_rate: f64 = 0.04,
        /// Windows looked at per frame while searching all over (ours), 1 to 1000.
        pub wide_windows: usize = 5,
        /// Windows looked at elsewhere per frame while unsure of what is followed (ours), 0 to 1000.
        pub side_windows: usize = 1,
        /// How far the predicted motion moves the search: 0 looks where the target was, 1 where it is predicted (ours),
        /// `[0, 1]`.
        pub lead: f64 = 0.0,
        /// How suddenly the target moves: spectral density of its acceleration in sizes² per s³ (ours), > 0.
        pub acceleration: f64 = 30.0,
        /// Score: constant of the logistic regression (ours, fitted).
        pub score_bias: f64 = -8.0,
        /// Score: weight of ln of the response's peak (ours, fitted).
        pub score_peak: f64 = 3.4,
        /// Score: weight of the likeness to the first view (ours, fitted).
        pub score_likeness: f64 = 17.2,
        /// Score: weight of ln of the colours' likelihood (ours, fitted).
        pub score_color: f64 = 1.72,
        /// Below this score the target counts as occluded (ours), `[0, 1]`.
        pub occluded_below: f64 = 0.8,
        /// An occluded target counts as seen again from this score (ours), `[0, 1]`.
        pub seen_from: f64 = 0.9,
        /// A lost target counts as found from this score (ours), `[0, 1]`.
        pub found_from: f64 = 0.85,
        /// Appearance is learned from this score (ours), `[0, 1]`.
        pub learn_from: f64 = 0.8,
        /// Time counts towards losing an occluded target while its score is below this (ours), `[0, 1]`.
        pub lost_below: f64 = 0.1,
        /// A target occluded for longer is lost and searched for all over, seconds (ours), ≥ 0.
        pub lost_after_s: f64 = 1.0,
    }
    validate(self) {
        let check = |name: &str, fine: bool, range: &str| if fine { Ok(()) } else { Err(Self::reject(name, range)) };
        check("cell_px", (2..=16).contains(&self.cell_px), "must be between 2 and 16")?;
        check("cells", (16..=128).contains(&self.cells), "must be between 16 and 128")?;
        check("search", (2.0..=8.0).contains(&self.search), "must be between 2 and 8")?;
        check("label_sigma", self.label_sigma > 0.0 && self.label_sigma < 1.0, "must be above 0 and below 1")?;
        check("penalty", self.penalty > 0.0 && self.penalty.is_finite(), "must be above 0")?;
        check("penalty_growth", (1.0..=1000.0).contains(&self.penalty_growth), "must be between 1 and 1000")?;
        check("iterations", (1..=10).contains(&self.iterations), "must be between 1 and 10")?;
        check("scale_area_px", (64.0..=16384.0).contains(&self.scale_area_px), "must be between 64 and 16384")?;
        check("size_kept_px", self.size_kept_px >= 0.0 && self.size_kept_px.is_finite(), "must be a number from 0 on")?;
        let followed = self.size_followed_px > self.size_kept_px && self.size_followed_px.is_finite();
        check("size_followed_px", followed, "must be above size_kept_px")?;
        check("color_inner_margin", (0.0..=0.4).contains(&self.color_inner_margin), "must be between 0 and 0.4")?;
        check("candidates", (1..=16).contains(&self.candidates), "must be between 1 and 16")?;
        check("wide_windows", (1..=1000).contains(&self.wide_windows), "must be between 1 and 1000")?;
        check("side_windows", self.side_windows <= 1000, "must be at most 1000")?;
        check("acceleration", self.acceleration > 0.0 && self.acceleration.is_finite(), "must be above 0")?;
        for (name, share) in [
            ("learning_rate", self.learning_rate),
            ("scale_learning_rate", self.scale_learning_rate),
            ("color_learning_rate", self.color_learning_rate),
            ("runner_up", self.runner_up),
            ("lead", self.lead),
            ("occluded_below", self.occluded_below),
            ("seen_from", self.seen_from),
            ("found_from", self.found_from),
            ("learn_from", self.learn_from),
            ("lost_below", self.lost_below),
        ] {
            check(name, (0.0..=1.0).contains(&share), "must be between 0 and 1")?;
        }
        for (name, weight) in [
            ("score_bias", self.score_bias),
            ("score_peak", self.score_peak),
            ("score_likeness", self.score_likeness),
            ("score_color", self.score_color),
        ] {
            check(name, weight.is_finite(), "must be a finite number")?;
        }
        check("lost_after_s", self.lost_after_s >= 0.0, "must not be negative")?;
    }
}
