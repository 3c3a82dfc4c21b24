//! Depth images as trackers look at them: windows of inverse depth, means and histograms of boxes. Millimetres in, 0 = no
//! data.

mod histogram;
mod params;
mod region;
mod sampler;

pub use histogram::{BINS, DepthHistogram};
pub use params::{HistogramParams, RegionParams};
pub use region::{BoxDepth, MeanDepth, Surface, samples};
pub use sampler::DepthSampler;

use pursuit_tracking::policy::{GatedParams, PolicyModel, PolicyParams};

/// The policy of methods that know by a rule of their own whether they see their target: one half of their probability is
/// that rule's threshold.
pub(crate) fn by_own_rule() -> PolicyParams {
    PolicyParams {
        model: PolicyModel::Gated,
        occluded_below: 0.5,
        seen_from: 0.5,
        found_from: 0.5,
        gated: GatedParams { far_from: 0.5, ..GatedParams::default() },
        learn_from: 0.5,
        lost_after_s: 2.0,
        ..PolicyParams::default()
    }
}
