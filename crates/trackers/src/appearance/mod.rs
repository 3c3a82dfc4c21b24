//! What trackers remember of how a target looks.

mod color_histogram;
mod first_colors;
mod initial_template;
mod kernel;
mod kernel_histogram;
mod object_model;
mod patch_sampler;
mod support;

pub use color_histogram::ColorHistogram;
pub use first_colors::FirstColors;
pub use initial_template::InitialTemplate;
pub use kernel::Kernel;
pub use kernel_histogram::{KernelHistogram, bin};
pub(crate) use object_model::draw;
pub use object_model::{ObjectModel, Resemblance, Similarity, SimilarityForm};
pub use patch_sampler::PatchSampler;
pub use support::Support;
