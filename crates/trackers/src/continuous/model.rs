//! What is known of the target: how features are compressed, the mixture of samples, and the filter trained on it.

use super::blocks::{Block, channels_mut};
use super::factorised::{self, FirstSample};
use super::gradients::{Directions, Steps, Unknown};
use super::objective::{Normal, Objective};
use super::params::{ConjugateGradientParams, ContinuousParams};
use super::sample_space::SampleSpace;
use pursuit_vision::fourier::Complex32;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// What is known of the target.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Model {
    /// The compression: for each channel kept, a row of one weight a feature; block after block.
    pub matrix: Vec<f32>,
    pub filter: Unknown,
    space: SampleSpace,
    /// Mean energy of each coefficient of the samples.
    energy: Vec<f32>,
    on: Directions,
    /// Samples learned.
    samples: usize,
    /// Samples learned since the filter was trained.
    untrained: usize,
}

/// Scratch of learning.
#[derive(Debug, Clone)]
pub(super) struct Learning {
    steps: Steps,
    inverse: Vec<f32>,
    products: Vec<f64>,
}

impl Learning {
    pub(super) fn new(length: usize) -> Self {
        Self { steps: Steps::new(length, 0), inverse: Vec::with_capacity(length), products: Vec::new() }
    }
}

impl Model {
    /// Learns filter and compression from the first sample; `matrix` is what to start from.
    pub(super) fn new(
        objective: &mut Objective,
        first: &FirstSample<'_>,
        params: &ConjugateGradientParams,
        mut matrix: Vec<f32>,
    ) -> Self {
        let length = objective.len();
        let mut filter = Unknown::zeros(length, 0);
        factorised::learn(objective, first, params, &mut matrix, &mut filter.filter.0);
        Self {
            matrix,
            filter,
            space: SampleSpace::default(),
            energy: vec![0.0; length],
            on: Directions::zeros(length, 0),
            samples: 0,
            untrained: 0,
        }
    }

    /// Whether a state that was read is one that learning leads to.
    pub(super) fn is_sound(&self, params: &ContinuousParams, blocks: &[Block], entries: usize) -> bool {
        let length = super::blocks::len(blocks);
        let energies = self.energy.iter().all(|e| e.is_finite() && *e >= 0.0);
        self.matrix.len() == entries
            && self.matrix.iter().all(|v| v.is_finite())
            && self.filter.is_sound(length, 0)
            && self.on.direction.is_sound(length, 0)
            && self.on.last.is_sound(length, 0)
            && self.on.size.is_finite()
            && self.energy.len() == length
            && energies
            && self.space.is_sound(&params.samples, blocks)
    }

    /// Learns a sample, and trains the filter when it is time to.
    pub(super) fn learn(
        &mut self,
        objective: &mut Objective,
        params: &ContinuousParams,
        sample: &[Complex32],
        scratch: &mut Learning,
    ) {
        let Learning { steps, inverse, products } = scratch;
        let rate = if self.samples == 0 { 1.0 } else { params.samples.learning_rate as f32 };
        self.space.learn(&params.samples, &objective.blocks, sample, products);
        for (energy, x) in self.energy.iter_mut().zip(sample) {
            *energy += rate * (x.norm_sqr() - *energy);
        }
        self.samples = self.samples.saturating_add(1);
        self.untrained = self.untrained.saturating_add(1);
        // The first filter is that of the first sample.
        if self.samples == 1 {
            self.untrained = 0;
        }
        let (solver, due) = (&params.solver, self.untrained >= params.solver.every_frames);
        if self.untrained == 0 || !(due || self.samples <= solver.at_first) {
            return;
        }
        self.untrained = 0;
        objective.precondition(solver, &self.energy, inverse);
        objective.descent(&self.space, &self.filter.filter.0, &mut steps.residual.filter.0);
        // A direction that counts for less: its size is taken for greater.
        self.on.size /= (1.0 - params.samples.learning_rate).powf(solver.forgetting).max(1e-9);
        let blocks = objective.blocks;
        let mut normal = Normal { objective, space: &self.space, inverse };
        steps.take(&blocks, &mut normal, &mut self.filter, &mut self.on, solver.iterations);
    }
}

/// Moves a sample by `(x, y)` periods: the target that was there is in the middle afterwards. `turns` is scratch.
pub(super) fn shift(
    blocks: &[Block],
    at: &[(usize, isize)],
    (x, y): (f64, f64),
    sample: &mut [Complex32],
    turns: &mut Vec<Complex32>,
) {
    turns.clear();
    turns.extend(at.iter().map(|&(u, v)| {
        let (sin, cos) = (TAU * (u as f64 * x + v as f64 * y)).sin_cos();
        Complex32::new(cos as f32, sin as f32)
    }));
    for channel in channels_mut(blocks, sample) {
        channel.iter_mut().zip(turns.iter()).for_each(|(c, turn)| *c *= turn);
    }
}
