//! Parameters of the trackers by continuous convolution.

use crate::correlation::{ScaleFilterParams, ScaleLadderParams, ScoreParams, WindowParams, WindowShape};

pursuit_parameters::parameters! {
    /// The window that is searched, a square, and the patch sampled from it.
    pub struct SquareWindowParams {
        /// How much larger the window's side is than the target's mean side √(width · height), less one.
        pub padding: f64 = 3.0, in 0.5..=8.0, unit "target sizes", source "danelljan2017eco, released settings of HC: 3";
        /// Side of a cell of gradients.
        pub cell_px: usize = 6, in 2..=8, unit "px", source "danelljan2017eco, table 1: 6";
        /// Side of a cell of colours.
        pub color_cell_px: usize = 4, in 2..=8, unit "px", source "danelljan2017eco, table 1: 4";
        /// Smallest area of the patch: windows of smaller targets are enlarged.
        pub smallest_area_px: f64 = 22_500.0, in 5_000.0..=250_000.0, unit "px²", source "danelljan2017eco, released settings of HC: 150²";
        /// Largest area of the patch: windows of larger targets are shrunk.
        pub largest_area_px: f64 = 40_000.0, in 5_000.0..=250_000.0, unit "px²", source "danelljan2017eco, released settings of HC: 200²";
        /// Smallest size of the target relative to its size at the start.
        pub smallest_scale: f64 = 0.1, in above(0.0).at_most(1.0), source "ours";
        /// Largest size of the target relative to its size at the start.
        pub largest_scale: f64 = 12.0, in 1.0..=100.0, source "ours";
    }
    ordered { smallest_area_px <= largest_area_px }
}

impl SquareWindowParams {
    /// The same for the window of the correlation trackers.
    pub(super) fn shared(&self) -> WindowParams {
        WindowParams {
            shape: WindowShape::Square,
            padding: self.padding,
            smallest_area_px: self.smallest_area_px,
            largest_area_px: self.largest_area_px,
            smallest_scale: self.smallest_scale,
            largest_scale: self.largest_scale,
            ..WindowParams::default()
        }
    }

    /// The patch's side is a multiple of this, so that it has whole cells of both kinds.
    pub(super) fn unit_px(&self) -> usize {
        let (a, b) = (self.cell_px.max(1), self.color_cell_px.max(1));
        let gcd = (1..=a.min(b)).rev().find(|d| a.is_multiple_of(*d) && b.is_multiple_of(*d)).unwrap_or(1);
        a / gcd * b
    }
}

pursuit_parameters::parameters! {
    /// The weight w of the filter's energy over the window: small inside the target, growing to the border.
    pub struct SpatialWeightParams {
        /// Its value in the middle of the target.
        pub center: f64 = 1e-4, in above(0.0), source "danelljan2017eco, released settings: 1e-4";
        /// What it has grown by at the target's edge.
        pub edge: f64 = 1e-2, in above(0.0), source "danelljan2017eco, released settings: 1e-2";
        /// Power of the distance that it grows with.
        pub power: f64 = 2.0, in 1.0..=8.0, source "danelljan2015: 2";
        /// Fourier coefficients below this share of the largest are left out.
        pub sparse_below: f64 = 0.05, in 0.005..=0.5, source "danelljan2017eco, released settings: 0.05";
    }
}

pursuit_parameters::choices! {
    /// What is kept of the samples.
    pub enum SampleModel {
        /// A mixture of few components, which samples are merged into (danelljan2017eco).
        Mixture = "mixture",
        /// What the normal equations need of every sample, older ones counting less (danelljan2016).
        Every = "every",
    }
}

pursuit_parameters::parameters! {
    /// The model of the target's looks.
    pub struct SampleParams {
        /// What is kept of the samples.
        pub model: SampleModel = SampleModel::Mixture;
        /// Most components L.
        pub components: usize = 30, in 2..=100, source "danelljan2017eco, released settings of HC: 30; section 4.1: 50", of [SampleModel::Mixture];
        /// Weight γ of a new sample; of `every`: once there are many.
        pub learning_rate: f64 = 0.009, in above(0.0).below(1.0), source "danelljan2017eco, section 4.1: 0.009; danelljan2016, section 5.1: 0.0075";
        /// A component that weighs less than a sample after so many frames is dropped before two are merged.
        pub dropped_after: usize = 60, in 1..=10_000, unit "frames", source "danelljan2017eco, section 3.2; released code: 2 L", of [SampleModel::Mixture];
    }
}

pursuit_parameters::choices! {
    /// How the channels of the features are compressed.
    pub enum CompressionModel {
        /// By a matrix that is learned together with the filter in the first frame (danelljan2017eco).
        Learned = "learned",
        /// Not at all (danelljan2016).
        None = "none",
    }
}

pursuit_parameters::parameters! {
    /// The compression of the features.
    pub struct CompressionParams {
        /// How channels are compressed.
        pub model: CompressionModel = CompressionModel::Learned;
        /// Channels that the gradients are compressed to.
        pub gradient_channels: usize = 10, in 1..=31, source "danelljan2017eco, table 1: 10", of [CompressionModel::Learned];
        /// Channels that colour names (of grey frames a histogram of brightness) are compressed to.
        pub color_channels: usize = 3, in 1..=8, source "danelljan2017eco, table 1: 3", of [CompressionModel::Learned];
        /// Gauss–Newton steps in the first frame.
        pub steps: usize = 10, in 1..=50, source "danelljan2017eco, section 4.1: 10", of [CompressionModel::Learned];
        /// Weight λ of the matrix.
        pub weight: f64 = 1e-5, in above(0.0), source "danelljan2017eco, released settings: 1e-7; ours: 1e-5", of [CompressionModel::Learned];
    }
}

pursuit_parameters::parameters! {
    /// Conjugate gradients.
    pub struct ConjugateGradientParams {
        /// Iterations in the first frame; where a compression is learned, in each of its steps.
        pub first_iterations: usize = 10, in 1..=500, source "danelljan2017eco, section 4.1: 10; danelljan2016, section 5.1: 100";
        /// Iterations N_CG whenever the filter is trained later.
        pub iterations: usize = 5, in 1..=50, source "danelljan2017eco, section 4.1: 5; danelljan2016, section 5.1: 5";
        /// The filter is trained in every so many frames, N_S.
        pub every_frames: usize = 6, in 1..=100, unit "frames", source "danelljan2017eco, section 3.3: 6";
        /// In the first frames it is trained in each.
        pub at_first: usize = 10, in 0..=1000, unit "frames", source "danelljan2017eco, released settings: 10";
        /// Power of 1 − γ by which the direction of the last training counts less in the next.
        pub forgetting: f64 = 50.0, in 0.0..=1e4, source "danelljan2017eco, released settings of HC: 50";
        /// Preconditioner: share of a channel's own energy, the rest is that of all channels.
        pub own_energy: f64 = 0.75, in 0.0..=1.0, source "danelljan2017eco, released settings of HC: 0.75";
        /// Preconditioner: share of the spatial weight's energy.
        pub weight_energy: f64 = 0.25, in above(0.0).below(1.0), source "danelljan2017eco, released settings of HC: 0.25";
    }
}

pursuit_parameters::parameters! {
    /// Parameters of the trackers by continuous convolution.
    pub struct ContinuousParams {
        /// The spline's parameter a.
        pub spline: f64 = -0.75, in -1.0..=0.0, source "danelljan2016, released settings: -0.75";
        /// Standard deviation of the label as a share of √(width · height) of the target.
        pub label_sigma: f64 = 0.0625, in above(0.0).below(1.0), source "danelljan2016, released settings: 1/16";
        /// Newton's steps at most between the cells.
        pub newton_steps: usize = 5, in 1..=20, source "danelljan2016, section 5.1: 5";
        /// The window.
        pub window: SquareWindowParams = SquareWindowParams::default();
        /// The weight over the window.
        pub spatial_weight: SpatialWeightParams = SpatialWeightParams::default();
        /// The compression of the features.
        pub compression: CompressionParams = CompressionParams::default();
        /// What is kept of the samples.
        pub samples: SampleParams = SampleParams::default();
        /// The solver.
        pub solver: ConjugateGradientParams = ConjugateGradientParams::default();
        /// Sizes that are simply tried.
        pub ladder: ScaleLadderParams = ScaleLadderParams::default();
        /// The filter along scale.
        pub scale: ScaleFilterParams = ScaleFilterParams::danelljan2017();
        /// The score, fitted as `docs/papers/danelljan2017.md` says.
        pub score: ScoreParams =
            ScoreParams { bias: -4.6, psr: 1.3, collapse: 1.0, likeness: 7.3, ..ScoreParams::default() };
    }
}

impl ContinuousParams {
    /// Those of danelljan2016, where features are not those of a network. The size is found by the filter along scale: tried sizes
    /// are there (`ladder`), and shrink on such features (`docs/papers/danelljan2016.md`).
    pub fn danelljan2016() -> Self {
        let defaults = Self::default();
        Self {
            compression: CompressionParams { model: CompressionModel::None, ..defaults.compression },
            samples: SampleParams { model: SampleModel::Every, learning_rate: 0.0075, ..defaults.samples },
            solver: ConjugateGradientParams { first_iterations: 100, every_frames: 1, at_first: 0, ..defaults.solver },
            ladder: ScaleLadderParams { levels: 0, step: 1.02, penalty: 1.0 },
            score: ScoreParams { bias: -5.6, ..defaults.score },
            ..defaults
        }
    }
}
