//! The bootstrap filter: predict, weigh, resample.

use nalgebra::{SMatrix, SVector};
use rand_core::{Rng, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::regularisation::optimal_bandwidth;
use super::resampling::{Resampling, effective_sample_size, multinomial, residual, stratified, systematic};
use crate::error::{require, require_time_step};
use crate::matrix::{require_finite, require_semi_definite, semi_definite_factor, symmetrise, times_vector};
use crate::nonlinear::NonlinearMotion;
use crate::{EstimationError, Gaussian, Result, Transition};

/// How a filter resamples.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ParticleOptions {
    /// The method.
    pub resampling: Resampling,
    /// [`ParticleFilter::resample_if_needed`] resamples where the effective sample size falls below this fraction of the
    /// particles, in [0, 1].
    pub threshold: f64,
    /// After resampling, particles are blurred by a Gaussian kernel of this many times the optimal bandwidth; 0 does not
    /// blur. Needed where motion adds little noise of its own.
    pub regularisation: f64,
}

impl Default for ParticleOptions {
    /// Systematic, below one half, not blurred.
    fn default() -> Self {
        Self { resampling: Resampling::Systematic, threshold: 0.5, regularisation: 0.0 }
    }
}

/// What a model of the caller's may answer.
const MODEL: EstimationError = EstimationError::NotFinite { what: "a particle moved by the motion model" };

/// A belief as weighted samples of a state of `N` components.
#[derive(Debug, Serialize, Deserialize)]
#[serde(remote = "ParticleFilter")]
pub struct ParticleFilter<const N: usize> {
    options: ParticleOptions,
    states: Vec<SVector<f64, N>>,
    /// The weights and their logarithms; both normalised.
    weights: Vec<f64>,
    #[serde(with = "logarithms")]
    log_weights: Vec<f64>,
    generator: Pcg64Mcg,
    /// Scratch, not state: so that no step allocates.
    #[serde(skip)]
    drawn: Vec<usize>,
    #[serde(skip)]
    next: Vec<SVector<f64, N>>,
    #[serde(skip)]
    likelihoods: Vec<f64>,
}

crate::checked!([const N: usize] ParticleFilter<N>);

impl<const N: usize> ParticleFilter<N> {
    fn restored(self) -> Result<Self> {
        let mut filter = Self::with_generator(self.states, self.options, self.generator)?;
        filter.expect_length(self.weights.len())?;
        filter.expect_length(self.log_weights.len())?;
        super::resampling::require_weights(&self.weights)?;
        for (&weight, log_weight) in self.weights.iter().zip(&self.log_weights) {
            let agree = (weight - log_weight.exp()).abs() <= 1e-9;
            require("the logarithm of a weight", weight, agree, "that of its weight")?;
        }
        (filter.weights, filter.log_weights) = (self.weights, self.log_weights);
        Ok(filter)
    }
}

/// Logarithms are stored as options: not every format can write −∞.
mod logarithms {
    use serde::{Deserialize, Deserializer, Serializer};

    pub fn serialize<S: Serializer>(logs: &[f64], serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(logs.iter().map(|log| log.is_finite().then_some(*log)))
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<f64>, D::Error> {
        let logs = Vec::<Option<f64>>::deserialize(deserializer)?;
        Ok(logs.into_iter().map(|log| log.unwrap_or(f64::NEG_INFINITY)).collect())
    }
}

impl<const N: usize> Clone for ParticleFilter<N> {
    fn clone(&self) -> Self {
        Self {
            options: self.options,
            states: self.states.clone(),
            log_weights: self.log_weights.clone(),
            weights: self.weights.clone(),
            generator: self.generator.clone(),
            drawn: Vec::with_capacity(self.states.len()),
            next: Vec::with_capacity(self.states.len()),
            likelihoods: Vec::with_capacity(self.states.len()),
        }
    }

    /// Allocates nothing where `self` has had as many particles: for looking ahead in every frame.
    fn clone_from(&mut self, source: &Self) {
        self.options = source.options;
        self.states.clone_from(&source.states);
        self.log_weights.clone_from(&source.log_weights);
        self.weights.clone_from(&source.weights);
        self.generator.clone_from(&source.generator);
    }
}

impl<const N: usize> ParticleFilter<N> {
    /// A filter of `count` particles drawn from `belief`, with all random numbers from `seed`.
    ///
    /// # Errors
    /// Where `count` is zero or an option is out of range.
    pub fn from_gaussian(count: usize, belief: &Gaussian<N>, options: ParticleOptions, seed: u64) -> Result<Self> {
        let factor = semi_definite_factor(belief.covariance());
        let mut generator = Pcg64Mcg::seed_from_u64(seed);
        let states = (0..count).map(|_| belief.mean() + times_vector(&factor, &normals(&mut generator))).collect();
        Self::with_generator(states, options, generator)
    }

    /// A filter of the equally weighted particles `states`.
    ///
    /// # Errors
    /// Where there are none, one is not finite or an option is out of range.
    pub fn from_states(states: Vec<SVector<f64, N>>, options: ParticleOptions, seed: u64) -> Result<Self> {
        Self::with_generator(states, options, Pcg64Mcg::seed_from_u64(seed))
    }

    fn with_generator(states: Vec<SVector<f64, N>>, options: ParticleOptions, generator: Pcg64Mcg) -> Result<Self> {
        let count = states.len();
        if count == 0 {
            return Err(EstimationError::Length { what: "particles", got: 0, expected: 1 });
        }
        require("threshold", options.threshold, (0.0..=1.0).contains(&options.threshold), "in [0, 1]")?;
        require("regularisation", options.regularisation, options.regularisation >= 0.0, "zero or more")?;
        states.iter().try_for_each(|state| require_finite("a particle", state))?;
        Ok(Self {
            options,
            log_weights: vec![-(count as f64).ln(); count],
            weights: vec![1.0 / count as f64; count],
            generator,
            drawn: Vec::with_capacity(count),
            next: Vec::with_capacity(count),
            likelihoods: Vec::with_capacity(count),
            states,
        })
    }

    /// The particles.
    pub fn states(&self) -> &[SVector<f64, N>] {
        &self.states
    }

    /// The particles' weights; they sum to one.
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// The logarithms of the weights.
    pub fn log_weights(&self) -> &[f64] {
        &self.log_weights
    }

    /// Moves every particle by `transition`, each with process noise of its own.
    ///
    /// # Errors
    /// Where a particle overflows; the particles are then as they were.
    pub fn predict(&mut self, transition: &Transition<N>) -> Result<()> {
        let factor = semi_definite_factor(transition.noise());
        // A singular noise (an acceleration, say) needs fewer random numbers than the state has components.
        let driven: [bool; N] = std::array::from_fn(|c| factor.column(c).iter().any(|value| *value != 0.0));
        let (matrix, offset) = (transition.matrix(), transition.offset());
        let generator = &mut self.generator;
        self.next.clear();
        self.next.extend(self.states.iter().map(|state| {
            let mut moved = times_vector(matrix, state) + offset;
            for c in 0..N {
                if driven[c] {
                    let normal: f64 = StandardNormal.sample(generator);
                    for r in c..N {
                        moved[r] += factor[(r, c)] * normal;
                    }
                }
            }
            moved
        }));
        self.commit(EstimationError::Overflow { what: "a moved particle" })
    }

    /// Moves every particle by a nonlinear `motion` over `dt_s` seconds, each with process noise of its own.
    ///
    /// # Errors
    /// Where `dt_s` is not positive and finite, or the model's answer is not finite or its noise not semi-definite; the
    /// particles are then as they were.
    pub fn predict_nonlinear(&mut self, motion: &impl NonlinearMotion<N>, dt_s: f64) -> Result<()> {
        require_time_step(dt_s)?;
        self.next.clear();
        for state in &self.states {
            let noise = require_semi_definite("the process noise", &motion.noise(state, dt_s))?;
            let kick = times_vector(&semi_definite_factor(&noise), &normals(&mut self.generator));
            self.next.push(motion.advance(state, dt_s) + kick);
        }
        self.commit(MODEL)
    }

    /// Moves every particle as `propose` says, which is handed the random numbers: any proposal at all.
    ///
    /// # Errors
    /// Where a particle is not finite; the particles are then as they were.
    pub fn predict_with(
        &mut self,
        mut propose: impl FnMut(&SVector<f64, N>, &mut Pcg64Mcg) -> SVector<f64, N>,
    ) -> Result<()> {
        self.next.clear();
        for state in &self.states {
            self.next.push(propose(state, &mut self.generator));
        }
        self.commit(MODEL)
    }

    /// Takes the moved particles over, if they are all finite; else this is the error.
    fn commit(&mut self, otherwise: EstimationError) -> Result<()> {
        // Zero times anything finite is zero: one branch for all of them.
        let sum: f64 = self.next.iter().map(|state| (state * 0.0).sum()).sum();
        if sum != 0.0 {
            return Err(otherwise);
        }
        std::mem::swap(&mut self.states, &mut self.next);
        Ok(())
    }

    /// Multiplies the weights by the likelihoods whose logarithms are given, one per particle, and normalises.
    ///
    /// Returns the logarithm of the measurement's likelihood under the whole belief.
    ///
    /// # Errors
    /// Where the lengths differ, a number is NaN or +∞ ([`EstimationError::NotFinite`]: a fault of the likelihood), or every
    /// particle is impossible, −∞ ([`EstimationError::Impossible`]: the target is lost); the weights are then as they were.
    pub fn weigh(&mut self, log_likelihoods: &[f64]) -> Result<f64> {
        self.expect_length(log_likelihoods.len())?;
        self.likelihoods.clear();
        self.likelihoods.extend(log_likelihoods.iter().zip(&self.log_weights).map(|(a, b)| a + b));
        self.normalise()
    }

    /// [`weigh`](Self::weigh) by likelihoods that are plain numbers, zero or more; their scale does not matter but for
    /// the value returned.
    ///
    /// # Errors
    /// Where the lengths differ, a number is negative or not finite ([`EstimationError::Parameter`]), or all are zero
    /// ([`EstimationError::Impossible`]); the weights are then as they were.
    pub fn weigh_plain(&mut self, likelihoods: &[f64]) -> Result<f64> {
        self.expect_length(likelihoods.len())?;
        for &value in likelihoods {
            require("a likelihood", value, value >= 0.0, "zero or more")?;
        }
        self.likelihoods.clear();
        self.likelihoods.extend(likelihoods.iter().zip(&self.log_weights).map(|(a, b)| a.ln() + b));
        self.normalise()
    }

    /// [`weigh`](Self::weigh) by a function of the state, evaluated on all cores.
    ///
    /// Each particle's value stands on its own and lands in its own place, so the answer does not depend on the threads.
    ///
    /// # Errors
    /// As [`weigh`](Self::weigh).
    pub fn weigh_by(&mut self, log_likelihood: impl Fn(&SVector<f64, N>) -> f64 + Sync) -> Result<f64> {
        // Enough particles per task that handing out tasks costs little.
        const CHUNK: usize = 64;
        self.likelihoods.clear();
        self.likelihoods.resize(self.states.len(), 0.0);
        self.likelihoods
            .par_iter_mut()
            .zip(&self.states)
            .zip(&self.log_weights)
            .with_min_len(CHUNK)
            .for_each(|((slot, state), log_weight)| *slot = log_likelihood(state) + log_weight);
        self.normalise()
    }

    fn expect_length(&self, got: usize) -> Result<()> {
        if got == self.states.len() {
            Ok(())
        } else {
            Err(EstimationError::Length { what: "likelihoods, one per particle", got, expected: self.states.len() })
        }
    }

    /// Makes the unnormalised log-weights in `likelihoods` the weights.
    fn normalise(&mut self) -> Result<f64> {
        let mut highest = f64::NEG_INFINITY;
        let mut sound = true;
        for &value in &self.likelihoods {
            sound &= value < f64::INFINITY;
            highest = highest.max(value);
        }
        if !sound {
            return Err(EstimationError::NotFinite { what: "the logarithm of a particle's likelihood" });
        }
        if highest == f64::NEG_INFINITY {
            return Err(EstimationError::Impossible { hypothesis: "particle" });
        }
        let mut total = 0.0;
        for (weight, value) in self.weights.iter_mut().zip(&self.likelihoods) {
            *weight = (value - highest).exp();
            total += *weight;
        }
        let evidence = highest + total.ln();
        let scale = 1.0 / total;
        for ((weight, log_weight), value) in self.weights.iter_mut().zip(&mut self.log_weights).zip(&self.likelihoods) {
            *weight *= scale;
            *log_weight = value - evidence;
        }
        Ok(evidence)
    }

    /// `1 / Σ w²`, from 1 to the number of particles.
    pub fn effective_sample_size(&self) -> f64 {
        effective_sample_size(&self.weights)
    }

    /// Resamples where the effective sample size is below the threshold; says whether it did.
    ///
    /// # Errors
    /// As [`resample`](Self::resample).
    pub fn resample_if_needed(&mut self) -> Result<bool> {
        let needed = self.effective_sample_size() < self.options.threshold * self.states.len() as f64;
        if needed {
            self.resample()?;
        }
        Ok(needed)
    }

    /// Draws the particles anew in proportion to their weights, which become equal, and blurs them if so asked.
    ///
    /// # Errors
    /// None that sound weights can cause.
    pub fn resample(&mut self) -> Result<()> {
        let blur = (self.options.regularisation > 0.0).then(|| {
            let bandwidth = self.options.regularisation * optimal_bandwidth(self.states.len(), N);
            semi_definite_factor(self.to_gaussian().covariance()) * bandwidth
        });
        let (generator, drawn) = (&mut self.generator, &mut self.drawn);
        let mut draw = || uniform(generator);
        match self.options.resampling {
            Resampling::Systematic => systematic(&self.weights, draw(), drawn)?,
            Resampling::Stratified => stratified(&self.weights, draw, drawn)?,
            Resampling::Residual => residual(&self.weights, draw(), drawn)?,
            Resampling::Multinomial => multinomial(&self.weights, draw, drawn)?,
        }
        self.next.clear();
        self.next.extend(drawn.iter().map(|&index| self.states[index]));
        if let Some(blur) = blur {
            for state in &mut self.next {
                *state += times_vector(&blur, &normals(&mut self.generator));
            }
        }
        self.commit(EstimationError::Overflow { what: "a blurred particle" })?;
        let count = self.states.len() as f64;
        self.weights.fill(1.0 / count);
        self.log_weights.fill(-count.ln());
        Ok(())
    }

    /// The weighted mean of the particles.
    pub fn mean(&self) -> SVector<f64, N> {
        let mut mean = SVector::zeros();
        for (state, weight) in self.states.iter().zip(&self.weights) {
            mean += state * *weight;
        }
        mean
    }

    /// The particle with the greatest weight; the first of several.
    pub fn heaviest(&self) -> SVector<f64, N> {
        let mut best = (0, f64::NEG_INFINITY);
        for (index, &weight) in self.weights.iter().enumerate() {
            if weight > best.1 {
                best = (index, weight);
            }
        }
        self.states[best.0]
    }

    /// Weighted mean and covariance of the particles. The covariance is singular where fewer than `N + 1` differ.
    pub fn to_gaussian(&self) -> Gaussian<N> {
        let mean = self.mean();
        let mut covariance = SMatrix::<f64, N, N>::zeros();
        for (state, weight) in self.states.iter().zip(&self.weights) {
            let away = state - mean;
            covariance += away * away.transpose() * *weight;
        }
        symmetrise(&mut covariance);
        Gaussian::trusted(mean, covariance)
    }
}

/// A uniform number in [0, 1), from 53 random bits.
fn uniform(generator: &mut impl Rng) -> f64 {
    (generator.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
}

/// Independent standard normal numbers.
fn normals<const N: usize>(generator: &mut Pcg64Mcg) -> SVector<f64, N> {
    SVector::from_fn(|_, _| StandardNormal.sample(generator))
}
