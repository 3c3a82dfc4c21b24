//! The filters that stand beside every paper's: a plain one and interacting multiple models, over measured positions.

use super::monte_carlo::best;
use crate::ExperimentError;
use nalgebra::SVector;
use pursuit_estimation::{EstimationError, Gaussian, Imm, LinearMeasurement, Switching, Transition};

/// A filter of measured positions on `M` axes.
pub(crate) trait PositionFilter<const M: usize> {
    /// One frame: the position predicted before `measured` is seen, and the estimate after.
    fn step(&mut self, measured: &SVector<f64, M>) -> Result<[SVector<f64, M>; 2], EstimationError>;
}

/// What a filter made of a sequence; index 0 is the measurement that it was started from.
#[derive(Debug, Clone, Default)]
pub(crate) struct Trace<const M: usize> {
    pub predicted: Vec<SVector<f64, M>>,
    pub filtered: Vec<SVector<f64, M>>,
}

impl<const M: usize> Trace<M> {
    /// Runs `filter`, which was started from the first of `measured`, over the rest.
    pub fn of(
        filter: &mut (impl PositionFilter<M> + ?Sized),
        measured: &[SVector<f64, M>],
    ) -> Result<Self, ExperimentError> {
        let first = measured.iter().take(1).copied();
        let mut trace = Self { predicted: first.clone().collect(), filtered: first.collect() };
        for value in measured.iter().skip(1) {
            let [before, after] = filter.step(value)?;
            trace.predicted.push(before);
            trace.filtered.push(after);
        }
        Ok(trace)
    }
}

/// Root mean square distance between two paths, all frames.
pub(crate) fn rmse<const M: usize>(a: &[SVector<f64, M>], b: &[SVector<f64, M>]) -> f64 {
    mean_square(a, b, |_| true).sqrt()
}

/// Mean square distance over the frames that `counts`.
pub(crate) fn mean_square<const M: usize>(
    a: &[SVector<f64, M>],
    b: &[SVector<f64, M>],
    counts: impl Fn(usize) -> bool,
) -> f64 {
    let frames = a.iter().zip(b).enumerate().filter(|(k, _)| counts(*k));
    super::monte_carlo::mean(frames.map(|(_, (a, b))| (a - b).norm_squared()))
}

/// A Kalman filter with one transition; the first `M` components of its `N` are the position.
#[derive(Debug, Clone)]
pub(crate) struct Plain<const M: usize, const N: usize> {
    pub transition: Transition<N>,
    pub sensor: LinearMeasurement<M, N>,
    pub belief: Gaussian<N>,
}

/// The leading components of a state.
pub(crate) fn position<const M: usize, const N: usize>(state: &SVector<f64, N>) -> SVector<f64, M> {
    SVector::from_fn(|i, _| state[i])
}

/// The sensor of the leading `M` components, each of variance `variance`.
pub(crate) fn position_sensor<const M: usize, const N: usize>(
    variance: f64,
) -> Result<LinearMeasurement<M, N>, EstimationError> {
    LinearMeasurement::select(std::array::from_fn(|i| i), [variance; M])
}

/// A belief with unit covariance, as the papers start: position `at`, then `velocity`, then zeros.
pub(crate) fn start<const M: usize, const N: usize>(
    at: &SVector<f64, M>,
    velocity: &SVector<f64, M>,
) -> Result<Gaussian<N>, EstimationError> {
    let mean = SVector::from_fn(|i, _| match i {
        i if i < M => at[i],
        i if i < 2 * M => velocity[i - M],
        _ => 0.0,
    });
    Gaussian::from_variances(mean, SVector::repeat(1.0))
}

impl<const M: usize, const N: usize> PositionFilter<M> for Plain<M, N> {
    fn step(&mut self, measured: &SVector<f64, M>) -> Result<[SVector<f64, M>; 2], EstimationError> {
        self.belief.predict(&self.transition)?;
        let before = position(self.belief.mean());
        self.belief.update(&self.sensor, measured)?;
        Ok([before, position(self.belief.mean())])
    }
}

/// Interacting multiple models with fixed transitions.
#[derive(Debug, Clone)]
pub(crate) struct Models<const M: usize, const N: usize, const K: usize> {
    pub transitions: [Transition<N>; K],
    pub switching: Switching<K>,
    pub sensor: LinearMeasurement<M, N>,
    pub modes: Imm<N, K>,
}

impl<const M: usize, const N: usize, const K: usize> Models<M, N, K> {
    /// Models that each last `1 / (1 − stay)` steps on average and are equally likely at the start and after another.
    pub fn new(
        transitions: [Transition<N>; K],
        stay: [f64; K],
        sensor: LinearMeasurement<M, N>,
        belief: Gaussian<N>,
    ) -> Result<Self, EstimationError> {
        let away = stay.map(|stay| (1.0 - stay) / (K as f64 - 1.0));
        let chances = nalgebra::SMatrix::from_fn(|i, j| if i == j { stay[i] } else { away[i] });
        let modes = Imm::new(belief, [1.0 / K as f64; K])?;
        Ok(Self { transitions, switching: Switching::per_step(chances)?, sensor, modes })
    }
}

impl<const M: usize, const N: usize, const K: usize> PositionFilter<M> for Models<M, N, K> {
    fn step(&mut self, measured: &SVector<f64, M>) -> Result<[SVector<f64, M>; 2], EstimationError> {
        self.modes.predict(&self.transitions, &self.switching)?;
        let before = position(self.modes.combined().mean());
        self.modes.update(&self.sensor, measured)?;
        Ok([before, position(self.modes.combined().mean())])
    }
}

/// The value among `candidates` whose `cost` is least; where none is finite, the first.
pub(crate) fn tuned(
    candidates: &[f64],
    cost: impl FnMut(f64) -> Result<f64, ExperimentError>,
) -> Result<f64, ExperimentError> {
    let found = best(candidates.iter().copied(), cost)?;
    Ok(found.map_or(f64::NAN, |(value, _)| value))
}
