//! Nonlinear motion as the affine step that a filter takes it for: what smoothers and histories need of it.

use nalgebra::SMatrix;

use super::unscented::Slope;
use super::{LinearizedMotion, NonlinearMotion, Unscented};
use crate::error::require_time_step;
use crate::matrix::{require_semi_definite, symmetrise, times_vector};
use crate::{Gaussian, Result, Transition};

impl<const N: usize> Gaussian<N> {
    /// The step that [`predict_extended`](Self::predict_extended) takes: `x ← F x + (f(m) − F m)`, with the slope `F` at
    /// the mean `m`.
    ///
    /// # Errors
    /// As [`predict_extended`](Self::predict_extended).
    pub fn linearized_extended(&self, motion: &impl LinearizedMotion<N>, dt_s: f64) -> Result<Transition<N>> {
        require_time_step(dt_s)?;
        let slope = motion.jacobian(self.mean(), dt_s);
        let step = Transition::new(slope, motion.noise(self.mean(), dt_s))?;
        step.with_offset(motion.advance(self.mean(), dt_s) - times_vector(&slope, self.mean()))
    }

    /// The step that [`predict_unscented`](Self::predict_unscented) takes, as a regression over the sigma points
    /// (statistical linearisation: Särkkä 2013, 3.4 and 5.5): its noise holds what the line misses of the curve.
    ///
    /// # Errors
    /// As [`predict_unscented`](Self::predict_unscented), or where the points' weights leave a noise that is no covariance
    /// (a spread `alpha` far from its default).
    pub fn linearized_unscented(
        &self,
        motion: &impl NonlinearMotion<N>,
        dt_s: f64,
        unscented: &Unscented,
    ) -> Result<Transition<N>> {
        require_time_step(dt_s)?;
        let weights = unscented.weights(N)?;
        let (points, lower) = unscented.points_and_factor(self)?;
        let moved = points.map(|point| motion.advance(point, dt_s));
        let mean = moved.mean(&weights);
        let Slope { matrix, missed } = Slope::over(&moved.map(|point| point - mean), &lower, &weights);
        let noise: SMatrix<f64, N, N> =
            require_semi_definite("the process noise", &motion.noise(self.mean(), dt_s))? + missed;
        let mut noise = noise;
        symmetrise(&mut noise);
        Transition::new(matrix, noise)?.with_offset(mean - times_vector(&matrix, self.mean()))
    }
}
