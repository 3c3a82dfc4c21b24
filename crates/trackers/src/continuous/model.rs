//! What is known of the target: how features are compressed, what is kept of the samples, and the filter trained on it.

use super::blocks::{Block, channels_mut};
use super::gradients::{Directions, Steps, Unknown};
use super::memory::Memory;
use super::objective::{Normal, Objective};
use super::params::{CompressionModel, ContinuousParams};
use pursuit_vision::fourier::Complex32;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// What is known of the target.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Model {
    /// The compression: for each channel kept, a row of one weight a feature; block after block. Empty where there is none.
    pub matrix: Vec<f32>,
    pub filter: Unknown,
    memory: Memory,
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
    /// With a compression and a filter of so many coefficients, of zeros.
    pub(super) fn new(params: &ContinuousParams, matrix: Vec<f32>, length: usize) -> Self {
        Self {
            matrix,
            filter: Unknown::zeros(length, 0),
            memory: Memory::new(&params.samples),
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
            && self.memory.is_sound(&params.samples, blocks)
    }

    /// Learns a sample, and trains the filter when it is time to.
    pub(super) fn learn(
        &mut self,
        objective: &mut Objective,
        params: &ContinuousParams,
        sample: &[Complex32],
        scratch: &mut Learning,
    ) {
        let weight = self.memory.learn(&params.samples, &objective.blocks, sample, &mut scratch.products);
        let rate = weight as f32;
        for (energy, x) in self.energy.iter_mut().zip(sample) {
            *energy += rate * (x.norm_sqr() - *energy);
        }
        self.samples = self.samples.saturating_add(1);
        self.untrained = self.untrained.saturating_add(1);
        let solver = &params.solver;
        if self.samples == 1 {
            self.untrained = 0;
            // A compression was learned together with the first filter.
            if params.compression.model == CompressionModel::None {
                self.train(objective, params, solver.first_iterations, scratch);
                self.on.size = 0.0;
            }
        } else if self.untrained >= solver.every_frames || self.samples <= solver.at_first {
            self.untrained = 0;
            self.train(objective, params, solver.iterations, scratch);
        }
    }

    /// Trains the filter on what is kept of the samples.
    fn train(
        &mut self,
        objective: &mut Objective,
        params: &ContinuousParams,
        iterations: usize,
        scratch: &mut Learning,
    ) {
        let (Learning { steps, inverse, .. }, solver) = (scratch, &params.solver);
        objective.precondition(solver, &self.energy, inverse);
        objective.descent(&self.memory, &self.filter.filter.0, &mut steps.residual.filter.0);
        // A direction that counts for less: its size is taken for greater.
        self.on.size /= (1.0 - params.samples.learning_rate).powf(solver.forgetting).max(1e-9);
        let blocks = objective.blocks;
        let mut normal = Normal { objective, memory: &self.memory, inverse };
        steps.take(&blocks, &mut normal, &mut self.filter, &mut self.on, iterations);
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
