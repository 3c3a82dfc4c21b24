//! `acpf`: an occlusion-aware particle filter on colour and depth after Meshgi et al. (CVIU 2016), the second baseline of
//! zhai2024. Each particle is a box and a flag that says whether the target is hidden there; where hidden particles explain
//! the frame better, the target is occluded, nothing is learned and the search widens. Written from its description.

mod colors;
mod localizer;

pub use colors::QuarterColors;
pub use localizer::AcpfLocalizer;

use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_tracking::motion::MotionParams;
use pursuit_tracking::policy::{PolicyModel, PolicyParams};
use pursuit_tracking::search::{SearchModel, SearchParams};
use pursuit_tracking::{GroupParams, LocalizerRecipe, Result, TrackerRecipe};

pursuit_tracking::parameters! {
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
        policy: PolicyParams {
            model: PolicyModel::Gated,
            occluded_below: 0.5,
            seen_from: 0.5,
            found_from: 0.5,
            far_from: 0.5,
            learn_from: 0.5,
            lost_after_s: 2.0,
            ..PolicyParams::default()
        },
        search: SearchParams { model: SearchModel::Near, ..SearchParams::default() },
    };
    TrackerRecipe { name, localizer: AcpfParams::default(), groups }
}
