//! What is kept of the samples that the filter is trained on.

use super::blocks::Block;
use super::moments::Moments;
use super::params::{SampleModel, SampleParams};
use super::sample_space::SampleSpace;
use pursuit_vision::fourier::Complex32;
use serde::{Deserialize, Serialize};

/// What is kept of the samples.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) enum Memory {
    /// Few components, which samples are merged into.
    Mixture(SampleSpace),
    /// What the normal equations need of every sample.
    Every(Moments),
}

impl Memory {
    /// Of no samples.
    pub(super) fn new(params: &SampleParams) -> Self {
        match params.model {
            SampleModel::Mixture => Self::Mixture(SampleSpace::default()),
            SampleModel::Every => Self::Every(Moments::default()),
        }
    }

    /// Whether a state that was read is one that learning leads to.
    pub(super) fn is_sound(&self, params: &SampleParams, blocks: &[Block]) -> bool {
        match (self, params.model) {
            (Self::Mixture(space), SampleModel::Mixture) => space.is_sound(params, blocks),
            (Self::Every(moments), SampleModel::Every) => moments.is_sound(blocks),
            _ => false,
        }
    }

    /// Learns a sample, and returns its weight among all. `scratch` is overwritten.
    pub(super) fn learn(
        &mut self,
        params: &SampleParams,
        blocks: &[Block],
        sample: &[Complex32],
        scratch: &mut Vec<f64>,
    ) -> f64 {
        match self {
            Self::Mixture(space) => space.learn(params, blocks, sample, scratch),
            Self::Every(moments) => moments.learn(params.learning_rate, blocks, sample),
        }
    }
}
