//! The unscented Kalman filter with van der Merwe's scaled sigma points.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use super::{NonlinearMotion, NonlinearSensor};
use crate::error::{require, require_time_step};
use crate::matrix::{require_finite, require_positive_definite, require_semi_definite, sandwich, symmetrise};
use crate::sharp::corrected;
use crate::{EstimationError, Gaussian, Innovation, LinearMeasurement, Result};

/// The spread and weights of the sigma points (van der Merwe 2004): `λ = α²(n + κ) − n`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Unscented {
    /// `α`, the spread about the mean, in (0, 1] usually.
    pub alpha: f64,
    /// `β`, knowledge of the distribution's shape; 2 for a Gaussian.
    pub beta: f64,
    /// `κ`, a secondary spread; 0 or `3 − n`. `n + κ` must be positive.
    pub kappa: f64,
}

impl Default for Unscented {
    /// `α = .5`, `β = 2`, `κ = 0`.
    fn default() -> Self {
        Self { alpha: 0.5, beta: 2.0, kappa: 0.0 }
    }
}

/// The `2 N + 1` sample points of a belief of `N` components, or their images in a space of `D` dimensions: the mean,
/// and a pair for each column of the scaled Cholesky factor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SigmaPoints<const D: usize, const N: usize> {
    /// The point at the mean.
    pub centre: SVector<f64, D>,
    /// The points `mean + column`.
    pub ahead: [SVector<f64, D>; N],
    /// The points `mean − column`.
    pub behind: [SVector<f64, D>; N],
}

impl<const D: usize, const N: usize> SigmaPoints<D, N> {
    /// Every point mapped by `f`.
    pub(super) fn map<const E: usize>(&self, f: impl Fn(&SVector<f64, D>) -> SVector<f64, E>) -> SigmaPoints<E, N> {
        SigmaPoints {
            centre: f(&self.centre),
            ahead: self.ahead.each_ref().map(&f),
            behind: self.behind.each_ref().map(&f),
        }
    }

    /// The weighted mean of the points.
    pub(super) fn mean(&self, weights: &Weights) -> SVector<f64, D> {
        let others: SVector<f64, D> = self.ahead.iter().chain(&self.behind).sum();
        self.centre * weights.centre_mean + others * weights.other
    }

    /// The weighted sum of products of these deviations with `other` deviations of the same points.
    fn products<const E: usize>(&self, other: &SigmaPoints<E, N>, weights: &Weights) -> SMatrix<f64, D, E> {
        let mut sum = SMatrix::<f64, D, E>::zeros();
        for i in 0..N {
            sum += self.ahead[i] * other.ahead[i].transpose() + self.behind[i] * other.behind[i].transpose();
        }
        sum * weights.other + self.centre * other.centre.transpose() * weights.centre_covariance
    }
}

/// The weights of the centre (in the mean, in covariances) and of every other point.
pub(super) struct Weights {
    centre_mean: f64,
    centre_covariance: f64,
    other: f64,
}

/// The straight line through the images of a belief's sigma points: `e = H (x − m)` and the covariance of what it misses.
pub(super) struct Slope<const D: usize, const N: usize> {
    pub matrix: SMatrix<f64, D, N>,
    pub missed: SMatrix<f64, D, D>,
}

impl<const D: usize, const N: usize> Slope<D, N> {
    /// The line through `spread`, the deviations of the images from their mean, of points at the columns of `lower`.
    ///
    /// With `H = P_zx P⁻¹` the pair of points at `± l_i` is missed on both sides by `(e⁺ + e⁻)/2`, and `H l_i` is
    /// `(e⁺ − e⁻)/2`: no variance is subtracted from another.
    pub fn over(spread: &SigmaPoints<D, N>, lower: &SMatrix<f64, N, N>, weights: &Weights) -> Self {
        let mut along = SMatrix::<f64, N, D>::zeros();
        let mut missed = spread.centre * spread.centre.transpose() * weights.centre_covariance;
        for i in 0..N {
            let (ahead, behind) = (spread.ahead[i], spread.behind[i]);
            along.row_mut(i).copy_from(&((ahead - behind) * 0.5).transpose());
            let off = (ahead + behind) * 0.5;
            missed += off * off.transpose() * (2.0 * weights.other);
        }
        // H L = (e⁺ − e⁻)/2, column by column; L has no zero on its diagonal.
        lower.tr_solve_lower_triangular_mut(&mut along);
        Self { matrix: along.transpose(), missed }
    }
}

impl Unscented {
    /// `n + λ = α²(n + κ)`.
    fn spread(&self, n: usize) -> Result<f64> {
        require("alpha", self.alpha, self.alpha > 0.0, "positive")?;
        require("beta", self.beta, true, "finite")?;
        let spread = self.alpha * self.alpha * (n as f64 + self.kappa);
        require("n + kappa", spread, spread > 0.0, "positive")?;
        Ok(spread)
    }

    pub(super) fn weights(&self, n: usize) -> Result<Weights> {
        let spread = self.spread(n)?;
        let centre_mean = (spread - n as f64) / spread;
        Ok(Weights {
            centre_mean,
            centre_covariance: centre_mean + 1.0 - self.alpha * self.alpha + self.beta,
            other: 0.5 / spread,
        })
    }

    /// The sigma points of `belief`.
    ///
    /// # Errors
    /// Where the parameters are out of range or the covariance is singular.
    pub fn points<const N: usize>(&self, belief: &Gaussian<N>) -> Result<SigmaPoints<N, N>> {
        Ok(self.points_and_factor(belief)?.0)
    }

    /// The sigma points of `belief`, and the scaled factor whose columns lead to them.
    pub(super) fn points_and_factor<const N: usize>(
        &self,
        belief: &Gaussian<N>,
    ) -> Result<(SigmaPoints<N, N>, SMatrix<f64, N, N>)> {
        let lower = belief.factor()? * self.spread(N)?.sqrt();
        let mean = *belief.mean();
        let points = SigmaPoints {
            centre: mean,
            ahead: std::array::from_fn(|i| mean + lower.column(i)),
            behind: std::array::from_fn(|i| mean - lower.column(i)),
        };
        Ok((points, lower))
    }
}

/// What a sensor reads at sigma points: the expected reading, and the deviations from it.
fn readings<const M: usize, const N: usize>(
    points: &SigmaPoints<N, N>,
    sensor: &impl NonlinearSensor<M, N>,
    weights: &Weights,
) -> (SVector<f64, M>, SigmaPoints<M, N>) {
    let readings = points.map(|point| sensor.expected(point));
    // The mean by way of differences to the centre, so that angles are averaged on the right side of the circle.
    let centre = readings.centre;
    let shift = readings.map(|reading| sensor.difference(reading, &centre)).mean(weights);
    let expected = centre + shift;
    (expected, readings.map(|reading| sensor.difference(reading, &expected)))
}

impl<const N: usize> Gaussian<N> {
    /// Moves the belief by a nonlinear `motion` over `dt_s` seconds through sigma points, and returns the moved points
    /// for [`update_unscented_with`](Self::update_unscented_with).
    ///
    /// # Errors
    /// Where `dt_s` is not positive and finite, the parameters are out of range, the covariance is singular, or the
    /// model's answer is not finite or not semi-definite; the belief is then as it was.
    pub fn predict_unscented(
        &mut self,
        motion: &impl NonlinearMotion<N>,
        dt_s: f64,
        unscented: &Unscented,
    ) -> Result<SigmaPoints<N, N>> {
        require_time_step(dt_s)?;
        let weights = unscented.weights(N)?;
        let moved = unscented.points(self)?.map(|point| motion.advance(point, dt_s));
        let mean = moved.mean(&weights);
        let away = moved.map(|point| point - mean);
        let noise = require_semi_definite("the process noise", &motion.noise(self.mean(), dt_s))?;
        let mut covariance = away.products(&away, &weights) + noise;
        symmetrise(&mut covariance);
        *self = Self::computed(mean, covariance)?;
        Ok(moved)
    }

    /// Corrects the belief by the reading `value` of a nonlinear `sensor`, through sigma points drawn anew from this
    /// belief, so that they carry the process noise too.
    ///
    /// # Errors
    /// As [`update_unscented_with`](Self::update_unscented_with), or where the covariance is singular.
    pub fn update_unscented<const M: usize>(
        &mut self,
        sensor: &impl NonlinearSensor<M, N>,
        value: &SVector<f64, M>,
        unscented: &Unscented,
    ) -> Result<Innovation<M>> {
        require_finite("the measurement", value)?;
        let weights = unscented.weights(N)?;
        let (points, lower) = unscented.points_and_factor(self)?;
        let (expected, spread) = readings(&points, sensor, &weights);
        let noise = require_semi_definite("the measurement noise", &sensor.noise())?;
        // As a regression over the points the update has a Joseph form, which the difference of covariances has not.
        let Slope { matrix, missed } = Slope::over(&spread, &lower, &weights);
        let mut noise = noise + missed;
        symmetrise(&mut noise);
        match LinearMeasurement::new(matrix, noise) {
            Ok(line) => {
                let found = corrected(self, &line, &sensor.difference(value, &expected))?;
                *self = found.belief;
                Ok(found.innovation)
            }
            // A negative weight of the centre can leave less than no noise.
            Err(EstimationError::NotPositive { .. }) => self.update_unscented_with(&points, sensor, value, unscented),
            Err(other) => Err(other),
        }
    }

    /// Corrects the belief through `points` made before, as [`predict_unscented`](Self::predict_unscented) returned
    /// them: cheaper by one factorisation, and blind to the process noise of the last step in `h`.
    ///
    /// # Errors
    /// Where a number is not finite, the sensor's noise is not semi-definite, the innovation covariance is singular, or
    /// the corrected covariance is no longer positive definite; the belief is then as it was.
    pub fn update_unscented_with<const M: usize>(
        &mut self,
        points: &SigmaPoints<N, N>,
        sensor: &impl NonlinearSensor<M, N>,
        value: &SVector<f64, M>,
        unscented: &Unscented,
    ) -> Result<Innovation<M>> {
        require_finite("the measurement", value)?;
        let weights = unscented.weights(N)?;
        let (expected, spread) = readings(points, sensor, &weights);
        let noise = require_semi_definite("the measurement noise", &sensor.noise())?;
        let mut covariance = spread.products(&spread, &weights) + noise;
        symmetrise(&mut covariance);
        let innovation = Innovation::new(sensor.difference(value, &expected), covariance)?;

        let mean = *self.mean();
        let cross = points.map(|point| point - mean).products(&spread, &weights);
        let gain = innovation.divide(&cross);
        // There is no Joseph form without a measurement matrix, so the result is checked instead.
        let covariance = self.covariance() - sandwich(&gain, &innovation.covariance());
        let corrected = Self::computed(mean + gain * innovation.residual(), covariance)?;
        require_positive_definite("the corrected covariance", corrected.covariance())?;
        *self = corrected;
        Ok(innovation)
    }
}
