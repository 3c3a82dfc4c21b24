//! Drawing particles anew in proportion to their weights, which are zero or more and **sum to one** (to 1e-6; any others
//! are refused). Every method writes 0-based indices of the particles kept; on an error the indices are of no use.

use serde::{Deserialize, Serialize};

use crate::error::require;
use crate::{EstimationError, Result};

/// How particles are drawn anew.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Resampling {
    /// One random number for all: positions `(u + i) / N`. Least noise and fastest; the default.
    #[default]
    Systematic,
    /// One random number for each stratum: positions `(u_i + i) / N`.
    Stratified,
    /// `⌊N w⌋` copies of each particle for sure, the rest systematically from what is left.
    Residual,
    /// Independent draws: the textbook's form, and the noisiest.
    Multinomial,
}

/// `1 / Σ w²` of weights that sum to one: how many equally weighted particles would say as much.
pub fn effective_sample_size(weights: &[f64]) -> f64 {
    1.0 / weights.iter().map(|weight| weight * weight).sum::<f64>()
}

/// Systematic resampling with `u` in [0, 1): the index is the first `j` with `(u + i)/N` below the cumulated weight.
///
/// # Errors
/// Where `weights` are none, negative, not finite or of another sum than one, or `u` is outside [0, 1).
pub fn systematic(weights: &[f64], u: f64, indices: &mut Vec<usize>) -> Result<()> {
    unit(u)?;
    let n = require_weights(weights)?;
    positions(weights, (0..n).map(|i| (u + i as f64) / n as f64), indices)
}

/// Stratified resampling, with a number `u_i` in [0, 1) for each particle.
///
/// # Errors
/// Where `weights` are none, negative, not finite or of another sum than one, or a drawn number is outside [0, 1).
pub fn stratified(weights: &[f64], mut uniform: impl FnMut() -> f64, indices: &mut Vec<usize>) -> Result<()> {
    let n = require_weights(weights)?;
    positions(weights, (0..n).map(|i| (uniform() + i as f64) / n as f64), indices)
}

/// Residual resampling: whole copies first, the rest systematically with `u` in [0, 1).
///
/// # Errors
/// Where `weights` are none, negative, not finite or of another sum than one, or `u` is outside [0, 1).
pub fn residual(weights: &[f64], u: f64, indices: &mut Vec<usize>) -> Result<()> {
    unit(u)?;
    let n = require_weights(weights)?;
    indices.clear();
    for (j, weight) in weights.iter().enumerate() {
        let copies = (weight * n as f64).floor() as usize;
        indices.extend(std::iter::repeat_n(j, copies.min(n - indices.len())));
    }
    let left = n - indices.len();
    // What is left of each weight, summing to `left`; positions u, u + 1, … among them.
    let (mut next, mut sum) = (u, 0.0);
    let mut last = None;
    for (j, weight) in weights.iter().enumerate() {
        let share = weight * n as f64;
        sum += share - share.floor();
        if share > share.floor() {
            last = Some(j);
        }
        while next < sum && indices.len() < n && next < left as f64 {
            indices.push(j);
            next += 1.0;
        }
    }
    // Rounding may leave the sum of the rests a hair short.
    while indices.len() < n {
        indices.push(last.unwrap_or(n - 1));
    }
    Ok(())
}

/// Multinomial resampling: `N` independent draws, in rising order. The order statistics of uniform numbers are made
/// directly (from the largest down), so nothing is sorted.
///
/// # Errors
/// Where `weights` are none, negative, not finite or of another sum than one, or a drawn number is outside [0, 1).
pub fn multinomial(weights: &[f64], mut uniform: impl FnMut() -> f64, indices: &mut Vec<usize>) -> Result<()> {
    let n = require_weights(weights)?;
    indices.clear();
    let mut cumulated: f64 = weights.iter().sum();
    let mut largest = 1.0_f64;
    let mut j = n - 1;
    for i in (0..n).rev() {
        let u = uniform();
        unit(u)?;
        largest *= (1.0 - u).powf(1.0 / (i + 1) as f64);
        while j > 0 && largest <= cumulated - weights[j] {
            cumulated -= weights[j];
            j -= 1;
        }
        indices.push(j);
    }
    indices.reverse();
    Ok(())
}

/// For rising positions in [0, 1): the first index whose cumulated weight exceeds each. The weights are sound.
fn positions(weights: &[f64], positions: impl Iterator<Item = f64>, indices: &mut Vec<usize>) -> Result<()> {
    let last = weights.len() - 1;
    indices.clear();
    let (mut j, mut cumulated) = (0, weights[0]);
    for position in positions {
        unit(position)?;
        // The last cumulated weight counts as one, whatever rounding left of it.
        while position >= cumulated && j < last {
            j += 1;
            cumulated += weights[j];
        }
        indices.push(j);
    }
    Ok(())
}

fn unit(u: f64) -> Result<()> {
    require("a random number", u, (0.0..1.0).contains(&u), "in [0, 1)")
}

/// The number of the weights, where they are a distribution.
pub(super) fn require_weights(weights: &[f64]) -> Result<usize> {
    if weights.is_empty() {
        return Err(EstimationError::Length { what: "weights to resample by", got: 0, expected: 1 });
    }
    let (mut sum, mut least) = (0.0, f64::INFINITY);
    for &weight in weights {
        sum += weight;
        // `min` would skip a NaN, but the sum does not.
        least = weight.min(least);
    }
    require("a weight to resample by", least, least >= 0.0, "zero or more")?;
    require("the sum of the weights to resample by", sum, (sum - 1.0).abs() <= SUM_TOLERANCE, "one")?;
    Ok(weights.len())
}

/// What rounding may leave of a sum of a million weights, with room.
const SUM_TOLERANCE: f64 = 1e-6;

#[cfg(test)]
mod tests {
    use super::*;

    const WEIGHTS: [f64; 5] = [0.02, 0.5, 0.0, 0.33, 0.15];

    /// The expected number of copies of each particle is `N w`, for every method.
    #[test]
    fn all_are_unbiased() {
        let runs = 20_000;
        let mut state = 1_u64;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let mut indices = Vec::new();
        for method in [Resampling::Systematic, Resampling::Stratified, Resampling::Residual, Resampling::Multinomial] {
            let mut counts = [0_u32; 5];
            for _ in 0..runs {
                match method {
                    Resampling::Systematic => systematic(&WEIGHTS, uniform(), &mut indices).unwrap(),
                    Resampling::Stratified => stratified(&WEIGHTS, &mut uniform, &mut indices).unwrap(),
                    Resampling::Residual => residual(&WEIGHTS, uniform(), &mut indices).unwrap(),
                    Resampling::Multinomial => multinomial(&WEIGHTS, &mut uniform, &mut indices).unwrap(),
                }
                assert_eq!(indices.len(), 5);
                assert!(indices.is_sorted() || method == Resampling::Residual);
                for &i in &indices {
                    counts[i] += 1;
                }
            }
            for (count, weight) in counts.into_iter().zip(WEIGHTS) {
                let mean = f64::from(count) / f64::from(runs);
                assert!((mean - 5.0 * weight).abs() < 0.03, "{method:?}: {mean} for {}", 5.0 * weight);
            }
        }
    }

    #[test]
    fn one_heavy_particle_takes_all() {
        let mut indices = Vec::new();
        let weights = [0.0, 0.0, 1.0, 0.0];
        systematic(&weights, 0.999, &mut indices).unwrap();
        assert_eq!(indices, [2; 4]);
        residual(&weights, 0.0, &mut indices).unwrap();
        assert_eq!(indices, [2; 4]);
        multinomial(&weights, || 0.37, &mut indices).unwrap();
        assert_eq!(indices, [2; 4]);
        assert_eq!(effective_sample_size(&weights), 1.0);
        assert!(systematic(&[], 0.5, &mut indices).is_err());
        assert!(systematic(&weights, 1.0, &mut indices).is_err());
    }
}
