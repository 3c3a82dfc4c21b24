//! Particle filters: beliefs of any shape, as weighted samples.
//!
//! A [`ParticleFilter`] is told its random numbers by a seed and gives the same answer on every machine, with any number
//! of threads. Weights are kept as logarithms, so a likelihood may be as small as it likes.

mod filter;
mod regularisation;
mod resampling;

pub use filter::{ParticleFilter, ParticleOptions};
pub use resampling::{Resampling, effective_sample_size, multinomial, residual, stratified, systematic};
