pursuit_parameters::parameters! {
    /// How the depth of a box is looked at.
    #[derive(Copy)]
    pub struct RegionParams {
        /// Points along a side of the grid that a box's depth is taken from.
        pub side: usize = 24, in 2..=256, unit "points", source "ours";
        /// The part of a box, about its middle, that its depth is taken from: corners are background.
        pub inner: f64 = 0.8, in above(0.0).at_most(1.0), unit "of its sides", source "ours";
        /// Fewer points with data than this share of a box tell nothing.
        pub least_valid: f64 = 0.05, in 0.0..=1.0, source "ours";
        /// The part of a box, about its middle, in which the first distance is looked for.
        pub first_part: f64 = 0.5, in above(0.0).at_most(1.0), unit "of its sides", source "ours";
        /// Width of a bin of the histogram, of 160 bins, in which the first distance is the commonest.
        pub first_bin_m: f64 = 0.05, in 0.001..=1.0, unit "m", source "ours";
        /// A surface covers at least this share of a box.
        pub least_surface: f64 = 0.1, in above(0.0).at_most(1.0), source "ours";
    }
}

pursuit_parameters::parameters! {
    /// Histograms of the depths in a box, of 32 bins (zhai2024, eq. 26).
    pub struct HistogramParams {
        /// Points along a side of the grid that they are made of.
        pub side: usize = 12, in 2..=256, unit "points", source "ours";
        /// The last bin ends here; what is farther is in it as well.
        pub range_m: f64 = 8.0, in above(0.0).at_most(65.535), unit "m", source "ours; zhai2024 leaves it open";
    }
}
