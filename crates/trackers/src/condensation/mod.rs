//! `condensation`: conditional density propagation (isard1998). Samples of where the target is are drawn anew by their weights,
//! moved by second-order dynamics and weighed by what the picture shows: the colours in the box and the edges along its outline.

mod contour;
mod dynamics;
mod localizer;

pub use contour::{ContourParams, Outline};
pub use dynamics::{Dynamics, DynamicsParams};
pub use localizer::{Condensation, CondensationFinding};

use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_tracking::motion::MotionParams;
use pursuit_tracking::policy::PolicyParams;
use pursuit_tracking::search::SearchParams;
use pursuit_tracking::{GroupParams, LocalizerRecipe, Result, TrackerRecipe};

pursuit_parameters::parameters! {
    /// Parameters of the conditional density propagation.
    pub struct CondensationParams {
        /// Samples, N.
        pub samples: usize = 200, in 8..=10_000, source "isard1998 uses 100 to 1500";
        /// How they move.
        pub dynamics: DynamicsParams = DynamicsParams::default();
        /// Width of the likelihood of colours.
        pub color_sigma: f64 = 0.07, in above(0.0), source "ours";
        /// Share of the outline in the logarithm of the likelihood; 0: the colours alone, 1: the outline alone, as isard1998 has it.
        pub contour_share: f64 = 0.3, in 0.0..=1.0, source "ours";
        /// The likelihood of an outline.
        pub contour: ContourParams = ContourParams::default();
        /// Share of the colours of a frame in the target's.
        pub learning_rate: f64 = 0.02, in 0.0..=1.0, source "ours";
        /// Bins of the histogram of each channel of each quarter of a box.
        pub bins: usize = 16, in 2..=256, source "ours";
        /// Points along a side of the grid that the colours are taken from; even, so that every point is in one quarter.
        pub side: usize = 12, in Bounds::from(2..=256).in_steps_of(2.0), unit "points", source "ours";
        /// Least size that is believed, relative to that at the start.
        pub least_size: f64 = 0.2, in above(0.0).at_most(1.0), source "ours";
        /// Greatest size that is believed.
        pub most_size: f64 = 5.0, in 1.0..=100.0, source "ours";
        /// The score, fitted as `docs/papers/isard1998.md` says.
        pub score: CondensationScoreParams = CondensationScoreParams::default();
    }
}

pursuit_parameters::parameters! {
    /// ln of p / (1 − p) of the probability p that the box is right.
    pub struct CondensationScoreParams {
        /// With nothing seen.
        pub bias: f64 = -9.3, in -50.0..=50.0, source "ours";
        /// For how alike the colours are.
        pub similarity: f64 = 10.8, in -100.0..=100.0, source "ours";
        /// For how well the outline lies on edges.
        pub outline: f64 = 3.3, in -100.0..=100.0, source "ours";
        /// For how far the samples are apart.
        pub spread: f64 = -32.0, in -100.0..=100.0, source "ours";
    }
}

impl LocalizerRecipe for CondensationParams {
    type Localizer = Condensation;

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<Condensation> {
        Condensation::new(self, frame, bbox)
    }
}

/// `condensation`.
pub fn condensation(name: &'static str) -> TrackerRecipe<CondensationParams> {
    let groups = GroupParams {
        // A mean of samples strays by a few hundredths of the target's size.
        motion: MotionParams { acceleration: 100.0, position_noise: 0.02, size_noise: 0.05, ..MotionParams::default() },
        policy: PolicyParams::patient(),
        search: SearchParams::default(),
    };
    TrackerRecipe { name, localizer: CondensationParams::default(), groups }
}
