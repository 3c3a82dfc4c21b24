//! The filters that are mostly fitted: positions measured, each further derivative unknown at the start.

use nalgebra::SVector;

use super::Candidate;
use crate::{EstimationError, Gaussian, Imm, LinearMeasurement, Mode, Result, Sojourn};

/// The first `M` of `N` components are read with one variance each; the start knows nothing of the others but their
/// variances, `[M .. 2 M]` first and so on.
fn setup<const M: usize, const N: usize, const D: usize>(
    variance: f64,
    variances: [f64; D],
) -> Result<(LinearMeasurement<M, N>, SVector<f64, N>)> {
    if M * (D + 1) != N {
        let expected = (N / M.max(1)).saturating_sub(1);
        return Err(EstimationError::Length { what: "variances of the derivatives at the start", got: D, expected });
    }
    let sensor = LinearMeasurement::select(std::array::from_fn(|row| row), [variance; M])?;
    let start = SVector::from_fn(|r, _| match (r / M).checked_sub(1) {
        None => variance,
        Some(order) => variances[order],
    });
    Ok((sensor, start))
}

/// The belief at a first reading of the position.
fn first<const M: usize, const N: usize>(value: &SVector<f64, M>, variances: &SVector<f64, N>) -> Result<Gaussian<N>> {
    Gaussian::from_variances(SVector::from_fn(|r, _| if r < M { value[r] } else { 0.0 }), *variances)
}

/// A Kalman filter of one way of moving.
#[derive(Debug, Clone)]
pub struct LinearFilter<Motion, const M: usize, const N: usize> {
    motion: Motion,
    sensor: LinearMeasurement<M, N>,
    variances: SVector<f64, N>,
    belief: Gaussian<N>,
}

impl<Motion: Mode<N>, const M: usize, const N: usize> LinearFilter<Motion, M, N> {
    /// A filter of positions measured with `variance` on each axis. `start_variances` are those of the derivatives (velocity
    /// first) when nothing but a position is known.
    ///
    /// # Errors
    /// Where a variance is not positive or there are not as many as the state has derivatives.
    pub fn new<const D: usize>(motion: Motion, variance: f64, start_variances: [f64; D]) -> Result<Self> {
        let (sensor, variances) = setup(variance, start_variances)?;
        let belief = Gaussian::from_variances(SVector::zeros(), variances)?;
        Ok(Self { motion, sensor, variances, belief })
    }
}

impl<Motion: Mode<N>, const M: usize, const N: usize> Candidate<M> for LinearFilter<Motion, M, N> {
    fn start(&mut self, value: &SVector<f64, M>) -> Result<()> {
        self.belief = first(value, &self.variances)?;
        Ok(())
    }

    fn predict(&mut self, dt_s: f64) -> Result<()> {
        self.belief = self.motion.predict(&self.belief, dt_s)?;
        Ok(())
    }

    fn update(&mut self, value: &SVector<f64, M>) -> Result<f64> {
        Ok(self.belief.update(&self.sensor, value)?.log_likelihood())
    }
}

/// Interacting ways of moving, with how long each lasts.
#[derive(Debug, Clone)]
pub struct ImmFilter<Motion, const M: usize, const N: usize, const K: usize> {
    modes: [Motion; K],
    sojourn: Sojourn<K>,
    sensor: LinearMeasurement<M, N>,
    variances: SVector<f64, N>,
    imm: Imm<N, K>,
}

impl<Motion: Mode<N>, const M: usize, const N: usize, const K: usize> ImmFilter<Motion, M, N, K> {
    /// An estimator of positions measured with `variance` on each axis, whose mode `k` lasts `mean_s[k]` seconds on average.
    /// `start_variances` as for [`LinearFilter::new`]; every mode is equally likely at the start.
    ///
    /// # Errors
    /// Where a variance or a duration is not positive, or there are not as many as the state has derivatives.
    pub fn new<const D: usize>(
        modes: [Motion; K],
        mean_s: [f64; K],
        variance: f64,
        start_variances: [f64; D],
    ) -> Result<Self> {
        let (sensor, variances) = setup(variance, start_variances)?;
        let imm = Imm::new(Gaussian::from_variances(SVector::zeros(), variances)?, [1.0 / K as f64; K])?;
        Ok(Self { modes, sojourn: Sojourn::new(mean_s)?, sensor, variances, imm })
    }
}

impl<Motion: Mode<N>, const M: usize, const N: usize, const K: usize> Candidate<M> for ImmFilter<Motion, M, N, K> {
    fn start(&mut self, value: &SVector<f64, M>) -> Result<()> {
        self.imm = Imm::new(first(value, &self.variances)?, [1.0 / K as f64; K])?;
        Ok(())
    }

    fn predict(&mut self, dt_s: f64) -> Result<()> {
        let modes = self.modes.each_ref().map(|mode| mode as &dyn Mode<N>);
        self.imm.predict_modes(&modes, &self.sojourn.over(dt_s)?, dt_s)
    }

    fn update(&mut self, value: &SVector<f64, M>) -> Result<f64> {
        self.imm.update(&self.sensor, value)
    }
}
