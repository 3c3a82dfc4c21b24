//! The unscented Kalman filter with van der Merwe's scaled sigma points.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use super::{NonlinearMotion, NonlinearSensor};
use crate::error::{require, require_time_step};
use crate::matrix::{require_finite, require_positive_definite, require_semi_definite, sandwich, symmetrise};
use crate::{Gaussian, Innovation, Result};

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
    fn map<const E: usize>(&self, f: impl Fn(&SVector<f64, D>) -> SVector<f64, E>) -> SigmaPoints<E, N> {
        SigmaPoints {
            centre: f(&self.centre),
            ahead: self.ahead.each_ref().map(&f),
            behind: self.behind.each_ref().map(&f),
        }
    }

    /// The weighted mean of the points.
    fn mean(&self, weights: &Weights) -> SVector<f64, D> {
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
struct Weights {
    centre_mean: f64,
    centre_covariance: f64,
    other: f64,
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

    fn weights(&self, n: usize) -> Result<Weights> {
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
        let lower = belief.factor()? * self.spread(N)?.sqrt();
        let mean = *belief.mean();
        Ok(SigmaPoints {
            centre: mean,
            ahead: std::array::from_fn(|i| mean + lower.column(i)),
            behind: std::array::from_fn(|i| mean - lower.column(i)),
        })
    }
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
        let points = unscented.points(self)?;
        self.update_unscented_with(&points, sensor, value, unscented)
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
        let readings = points.map(|point| sensor.expected(point));
        // The mean by way of differences to the centre, so that angles are averaged on the right side of the circle.
        let centre = readings.centre;
        let shift = readings.map(|reading| sensor.difference(reading, &centre)).mean(&weights);
        let expected = centre + shift;
        let spread = readings.map(|reading| sensor.difference(reading, &expected));
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
