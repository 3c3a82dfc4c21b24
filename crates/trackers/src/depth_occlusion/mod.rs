//! `depth-occlusion` (zhai2024): kernelized correlation on depth that knows *why* it no longer sees its target.
//!
//! One filling of the one loop. The response of a filter on gradients of depth is held against the distance it was found at
//! (`response`), so that the policy sees an occlusion and stops the filter from learning it. Meanwhile particles
//! (`hypotheses`) and what hides the target (`occluder`) say where to look for it with the filter as it was. Frames
//! without depth are looked at by a filter on the picture. See `docs/papers/zhai2024.md`.

mod hypotheses;
mod localizer;
mod occluder;
mod params;
mod path;
mod place;
mod response;
mod target;

pub use hypotheses::Hypotheses;
pub use localizer::{DepthFinding, DepthLocalizer};
pub use occluder::Occluder;
pub use params::{DepthOcclusionParams, OccluderParams, SpaceParams};
pub use path::{Pinhole, SpacePath};
pub use response::{Judged, penalised};
pub use target::{Candidate, Sought, TargetDepth};

use crate::depth::by_own_rule;
use crate::kcf::KcfFeatures;
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_tracking::motion::MotionParams;
use pursuit_tracking::search::SearchParams;
use pursuit_tracking::{GroupParams, LocalizerRecipe, Result, TrackerRecipe};

impl LocalizerRecipe for DepthOcclusionParams {
    type Localizer = DepthLocalizer;

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<DepthLocalizer> {
        DepthLocalizer::new(self, frame, bbox)
    }
}

fn groups() -> GroupParams {
    GroupParams {
        motion: MotionParams { acceleration: 100.0, ..MotionParams::default() },
        policy: by_own_rule(),
        search: SearchParams { wide_windows: 16, outside: 1.0, ..SearchParams::default() },
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
