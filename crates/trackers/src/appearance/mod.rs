//! What trackers remember of how a target looks.

mod color_histogram;
mod initial_template;
mod object_model;
mod patch_sampler;
mod support;

pub use color_histogram::ColorHistogram;
pub use initial_template::InitialTemplate;
pub(crate) use object_model::draw;
pub use object_model::{ObjectModel, Resemblance, Similarity, SimilarityForm};
pub use patch_sampler::PatchSampler;
pub use support::Support;
