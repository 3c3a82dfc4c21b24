//! `depth-occlusion` (zhai2024): kernelized correlation on depth that knows *why* it no longer sees its target.
//!
//! One filling of the one loop. The response of a filter on gradients of depth is held against the distance it was found at
//! (`response`), so that the policy sees an occlusion and stops the filter from learning it. Meanwhile particles
//! (`hypotheses`) and what hides the target (`occluder`) say where to look for it with the filter as it was. Frames
//! without depth are looked at by a filter on the picture. See `docs/papers/zhai2024.md`.

mod hypotheses;
mod localizer;
mod occluder;
mod path;
mod response;
mod target;

pub use hypotheses::{Hypotheses, HypothesisRules};
pub use localizer::DepthLocalizer;
pub use occluder::Occluder;
pub use path::{Pinhole, SpacePath};
pub use response::{Judged, penalised};
pub use target::{Candidate, TargetDepth};

use crate::kcf::{KcfFeatures, KcfParams};
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_tracking::motion::MotionParams;
use pursuit_tracking::policy::{PolicyModel, PolicyParams};
use pursuit_tracking::search::SearchParams;
use pursuit_tracking::{GroupParams, LocalizerRecipe, Result, TrackerRecipe};

pursuit_tracking::parameters! {
    /// Parameters of the depth-aware tracker.
    pub struct DepthOcclusionParams {
        /// ε: what a metre of difference between the mean depths, before and here, takes from the response.
        pub epsilon: f64 = 0.15, in 0.0..=10.0, unit "1/m", source "zhai2024, eq. 20; section 3: 0.1 to 0.2";
        /// ε′: the same while the target is out of sight.
        pub epsilon_again: f64 = 0.2, in 0.0..=10.0, unit "1/m", source "zhai2024, eq. 30; section 3: 0.2";
        /// minFz: below this response the target is occluded.
        pub min_response: f64 = 0.2, in 0.0..=1.0, source "zhai2024, section 3: 0.2";
        /// The same where nothing nearer covers it and what is there is as far away as it was: a target that only looks
        /// different is no occluded one. Equal to `min_response`: the paper.
        pub min_clear: f64 = 0.1, in 0.0..=1.0, source "ours";
        /// Δf: a target out of sight is found where the response is less than this below the usual one.
        pub response_drop: f64 = 0.2, in 0.0..=1.0, source "zhai2024, eq. 30; section 3: 0.15 to 0.25";
        /// The same where most of what is there is as far away as the target was: then it may look more different. Equal to
        /// `response_drop`: the paper.
        pub drop_clear: f64 = 0.35, in 0.0..=1.0, source "ours";
        /// What being wholly covered by something nearer takes from the response; 0: the paper.
        pub cover_weight: f64 = 0.3, in 0.0..=10.0, source "ours";
        /// Things nearer than the target by this cover it.
        pub nearer_by: f64 = 0.12, in above(0.0), unit "m", source "ours";
        /// How far from its mean distance what is part of the target may be.
        pub half_depth: f64 = 0.3, in above(0.0), unit "m", source "ours";
        /// A target of which more than this share is covered is not learned.
        pub learn_covered: f64 = 0.15, in 0.0..=1.0, source "ours";
        /// Change of the response that changes the odds of the score by e.
        pub softness: f64 = 0.05, in above(0.0), source "ours";
        /// Particles, N.
        pub particles: usize = 50, in 1..=10_000, source "ours; zhai2024 leaves it open";
        /// Width σ of the likelihood.
        pub likelihood_sigma: f64 = 0.1, in above(0.0), source "ours; zhai2024, eq. 27 leaves it open";
        /// Depths less similar to the target's than this say nothing: a hidden target's are those of what hides it.
        pub least_similarity: f64 = 0.6, in 0.0..=1.0, source "ours";
        /// Particles are drawn anew where N_eff falls below this share of them.
        pub resample_below: f64 = 0.5, in 0.0..=1.0, source "ours; zhai2024, section 2.2.5 leaves it open";
        /// Places about the particles that are searched with the model as it was.
        pub clusters: usize = 3, in 0..=32, source "ours";
        /// Whether the edges of what hides the target are searched too.
        pub occluder_edges: bool = true, source "ours";
        /// Whether the size follows the distance.
        pub scale_from_depth: bool = true, source "ours";
        /// The filter on the picture, for frames without depth, learns every so many frames.
        pub picture_every: usize = 4, in 1..=1000, unit "frames", source "ours";
        /// The filter on depth.
        pub filter: KcfParams = KcfParams { features: KcfFeatures::DepthHog, ..KcfParams::fixed() };
        /// The filter on the picture, for frames without depth.
        pub picture: KcfParams = KcfParams::default();
    }
}

impl DepthOcclusionParams {
    /// The paper alone: no cover, no edges, a size that stays.
    pub fn zhai2024() -> Self {
        Self {
            min_clear: 0.2,
            drop_clear: 0.2,
            cover_weight: 0.0,
            learn_covered: 1.0,
            occluder_edges: false,
            scale_from_depth: false,
            ..Self::default()
        }
    }

    fn rules(&self) -> HypothesisRules {
        HypothesisRules {
            particles: self.particles,
            likelihood_sigma: self.likelihood_sigma,
            least_similarity: self.least_similarity,
            resample_below: self.resample_below,
        }
    }
}

impl LocalizerRecipe for DepthOcclusionParams {
    type Localizer = DepthLocalizer;

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<DepthLocalizer> {
        DepthLocalizer::new(self, frame, bbox)
    }
}

fn groups() -> GroupParams {
    GroupParams {
        motion: MotionParams { acceleration: 100.0, ..MotionParams::default() },
        // One half is the threshold of the paper's rules; see `Judged::probability`.
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
        search: SearchParams { wide_windows: 8, ..SearchParams::default() },
    }
}

/// `depth-occlusion`: on depth, whatever the light.
pub fn depth_occlusion(name: &'static str) -> TrackerRecipe<DepthOcclusionParams> {
    TrackerRecipe { name, localizer: DepthOcclusionParams::default(), groups: groups() }
}

/// `depth-occlusion-fused`: on depth and the picture together.
pub fn depth_occlusion_fused(name: &'static str) -> TrackerRecipe<DepthOcclusionParams> {
    let mut recipe = depth_occlusion(name);
    recipe.localizer.filter.features = KcfFeatures::FusedHog;
    recipe
}
