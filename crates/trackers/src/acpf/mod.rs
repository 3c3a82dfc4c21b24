//! `acpf`: an occlusion-aware particle filter on colour and depth after Meshgi et al. (CVIU 2016), the second baseline of
//! zhai2024. Each particle is a box and a flag that says whether the target is hidden there; where hidden particles explain
//! the frame better, the target is occluded, nothing is learned and the search widens. Written from its description.

mod colors;
mod localizer;

pub use colors::QuarterColors;
pub use localizer::AcpfLocalizer;

use crate::depth::{HistogramParams, by_own_rule};
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_tracking::motion::MotionParams;
use pursuit_tracking::search::{SearchModel, SearchParams};
use pursuit_tracking::{GroupParams, LocalizerRecipe, Result, TrackerRecipe};

pursuit_parameters::parameters! {
    /// Parameters of the occlusion-aware particle filter.
    pub struct AcpfParams {
        /// Particles.
        pub particles: usize = 150, in 8..=10_000, source "ours; meshgi2016 does not depend on it";
        /// Standard deviation of a particle's step.
        pub step: f64 = 0.12, in above(0.0), unit "target sizes", source "ours";
        /// The same while the target is hidden: the search widens.
        pub hidden_step: f64 = 0.25, in above(0.0), unit "target sizes", source "meshgi2016: wider while occluded";
        /// Standard deviation of the change of a particle's size.
        pub size_step: f64 = 0.015, in 0.0..=1.0, source "ours";
        /// Width of the likelihood of colours.
        pub color_sigma: f64 = 0.12, in above(0.0), source "ours";
        /// Width of the likelihood of depths.
        pub depth_sigma: f64 = 0.15, in above(0.0), source "ours";
        /// How alike a hidden target counts as: boxes less alike than this are explained better by an occlusion.
        pub hidden_similarity: f64 = 0.72, in 0.0..=1.0, source "ours";
        /// Probability that a target in sight is hidden in the next frame.
        pub hides: f64 = 0.05, in 0.0..=1.0, source "ours";
        /// Probability that a hidden target is in sight in the next frame.
        pub shows: f64 = 0.2, in 0.0..=1.0, source "ours";
        /// Share of the new colours and depths per frame.
        pub learning_rate: f64 = 0.02, in 0.0..=1.0, source "ours";
        /// Change of the similarity that changes the odds of the score by e.
        pub softness: f64 = 0.03, in above(0.0), source "ours";
        /// Particles are drawn anew where N_eff falls below this share of them.
        pub resample_below: f64 = 0.5, in 0.0..=1.0, source "ours";
        /// Least size that is believed, relative to that at the start.
        pub least_size: f64 = 0.2, in above(0.0).at_most(1.0), source "ours";
        /// Greatest size that is believed.
        pub most_size: f64 = 5.0, in 1.0..=100.0, source "ours";
        /// Bins of the histogram of each channel of each quarter of a box.
        pub bins: usize = 16, in 2..=256, source "ours";
        /// Points along a side of the grid that the colours are taken from; even, so that every point is in one quarter.
        pub side: usize = 12, in Bounds::from(2..=256).in_steps_of(2.0), unit "points", source "ours";
        /// Histograms of depth.
        pub histogram: HistogramParams = HistogramParams::default();
    }
}

impl LocalizerRecipe for AcpfParams {
    type Localizer = AcpfLocalizer;

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<AcpfLocalizer> {
        AcpfLocalizer::new(self, frame, bbox)
    }
}

/// `acpf`.
pub fn acpf(name: &'static str) -> TrackerRecipe<AcpfParams> {
    let groups = GroupParams {
        // A mean of particles strays by a few hundredths of the target's size.
        motion: MotionParams { acceleration: 100.0, position_noise: 0.02, size_noise: 0.05, ..MotionParams::default() },
        policy: by_own_rule(),
        search: SearchParams { model: SearchModel::Near, ..SearchParams::default() },
    };
    TrackerRecipe { name, localizer: AcpfParams::default(), groups }
}
