//! Depth images as trackers look at them: windows of inverse depth, means and histograms of boxes. Millimetres in, 0 = no
//! data.

mod histogram;
mod region;
mod sampler;

pub use histogram::{BINS, DepthHistogram};
pub use region::{BoxDepth, MeanDepth, Surface, samples};
pub use sampler::DepthSampler;
