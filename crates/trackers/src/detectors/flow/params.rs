pursuit_parameters::parameters! {
    /// Parameters of the detector of what moves before a moving camera.
    pub struct FlowDetectorParams {
        /// Pictures are halved until their shorter side is no longer than this.
        pub resolution_px: usize = 300, in 32..=4096, unit "px", source "ours";
        /// Least motion against the scene from frame to frame, pixels of the halved picture.
        pub threshold_px: f64 = 0.6, in above(0.0).at_most(100.0), unit "px", source "ours";
        /// … and this many times what the scene itself seems to move by (the median over the picture).
        pub noise_ratio: f64 = 4.0, in 0.0..=1000.0, source "ours";
        /// A mover's motion must explain the picture better than the camera's by so much, mean over the surroundings of a pixel.
        pub gain: f64 = 3.0, in 0.0..=255.0, unit "codes", source "ours";
        /// Radius of those surroundings.
        pub reach_px: usize = 2, in 0..=32, unit "px", source "ours";
        /// Radius of the closing that joins the parts of a thing.
        pub closing: f64 = 0.02, in 0.0..=0.1, unit "frame heights", source "ours";
        /// Least area of a mover.
        pub least_area: f64 = 0.0005, in above(0.0).at_most(1.0), unit "of the picture", source "ours";
        /// Where more of the picture than this moves against the scene, the scene has not been understood and nothing is told.
        pub most_area: f64 = 0.5, in above(0.0).at_most(1.0), source "ours";
        /// Share of the points that must agree on the camera's motion.
        pub agreement: f64 = 0.35, in above(0.0).at_most(1.0), source "ours";
        /// A mover is told for certain when the frame before had one where it comes from; the overlap (IoU) that makes it the same.
        pub known: f64 = 0.2, in 0.0..=1.0, source "ours";
        /// What the confidence in a mover seen for the first time is worth.
        pub first: f64 = 0.49, in 0.0..=1.0, source "ours";
        /// Side of a patch of the flow: 4, 8, 12 or 16.
        pub patch_px: usize = 8, in 4..=16, unit "px", source "kroeger2016, section 3";
        /// How much patches overlap.
        pub overlap: f64 = 0.6, in 0.0..=0.9, source "ours; kroeger2016: 0.3 to 0.75";
    }
}
