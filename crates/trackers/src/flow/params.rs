//! How a box is followed by the points in it.

use pursuit_geometry::Size;
use pursuit_parameters::ParameterError;
use pursuit_tracking::Result;
use pursuit_vision::flow::{LucasKanadeParams, MedianFlow, MedianFlowParams, ScaleRule};

pursuit_parameters::choices! {
    /// How the size follows from the ratios of pairwise distances.
    pub enum ScaleBy {
        /// Their median (kalal2010).
        Median = "median",
        /// Their mean (zhu2014, equation (9)).
        Mean = "mean",
    }
}

pursuit_parameters::parameters! {
    /// How a box is followed by the points in it.
    pub struct FlowParams {
        /// Points across, and down.
        pub points: usize = 10, in 2..=64, source "kalal2010, section 3; zhu2014: 10";
        /// Share of the box's sides that the points cover: its border is half background.
        pub cover: f64 = 0.9, in above(0.0).at_most(1.0), source "ours; released TLD: 5 px less on each side";
        /// Side of the window in which a point is followed.
        pub window_px: usize = 9, in 3..=63, unit "px", source "released TLD: 9";
        /// Most levels of the pyramid.
        pub levels: usize = 5, in 1..=8, source "released TLD: 5";
        /// Most iterations on a level.
        pub iterations: usize = 20, in 1..=100, source "ours";
        /// A step shorter than this ends the iterations.
        pub epsilon_px: f64 = 0.03, in 0.0..=1.0, unit "px", source "ours";
        /// Side of the patches that are correlated.
        pub patch_px: usize = 10, in 3..=63, unit "px", source "kalal2010, section 3: 10";
        /// How the size follows.
        pub scale_by: ScaleBy = ScaleBy::Median, source "kalal2010; the mean: zhu2014, equation (9)";
        /// The box is lost beyond this median deviation from the median displacement.
        pub residual_px: f64 = 10.0, in above(0.0), unit "px", source "kalal2012, section 5.5: 10";
        /// The box is lost beyond this median forward-backward error.
        pub error_px: f64 = 10.0, in above(0.0), unit "px", source "released TLD: 10";
        /// The points are looked for first where the motion model predicts the box, on so many levels of the pyramid; 0: where they
        /// were, on all levels.
        pub guided_levels: usize = 0, in 0..=8, source "ours; kalal2010: 0";
        /// What was found from the prediction counts if the median forward-backward error is at most this; else the points are looked
        /// for where they were, on all levels.
        pub guided_error_px: f64 = 0.5, in 0.0..=10.0, unit "px", source "ours";
        /// What is kept of a frame on every side of the box, for the next one, in longer sides of the box.
        pub margin: f64 = 0.75, in 0.0..=10.0, unit "target sizes", source "ours";
        /// What is kept at least.
        pub least_margin_px: f64 = 32.0, in 0.0..=1000.0, unit "px", source "ours";
    }
    renamed { "scale" => ["scale_by"] }
}

impl FlowParams {
    /// Points in windows of 8 px: rows of one vector each are followed in half the time of rows of 9 px.
    pub fn eight_px() -> Self {
        Self { window_px: 8, ..Self::default() }
    }

    /// The estimator these make.
    pub(super) fn estimator(&self) -> Result<MedianFlow> {
        let window = Size::new(self.window_px, self.window_px);
        let params = MedianFlowParams {
            grid: Size::new(self.points, self.points),
            flow: LucasKanadeParams {
                window,
                levels: self.levels,
                iterations: self.iterations,
                epsilon_px: self.epsilon_px,
                ..LucasKanadeParams::default()
            },
            patch_px: self.patch_px,
            scale: match self.scale_by {
                ScaleBy::Median => ScaleRule::Median,
                ScaleBy::Mean => ScaleRule::Mean,
            },
            max_residual_px: self.residual_px,
            max_forward_backward_px: self.error_px,
        };
        MedianFlow::new(params).map_err(|e| ParameterError::new("flow", "flow", e.to_string()).into())
    }
}
