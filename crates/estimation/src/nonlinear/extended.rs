//! The extended Kalman filter: motion and sensor replaced by their tangents at the mean.

use nalgebra::SVector;

use super::{LinearizedMotion, LinearizedSensor};
use crate::error::require_time_step;
use crate::matrix::{require_finite, require_semi_definite, sandwich};
use crate::sharp::corrected;
use crate::{Gaussian, Innovation, LinearMeasurement, Result};

impl<const N: usize> Gaussian<N> {
    /// Moves the belief by a nonlinear `motion` over `dt_s` seconds, linearised at the mean.
    ///
    /// # Errors
    /// Where `dt_s` is not positive and finite, the model's answer is not finite, or its noise is not semi-definite; the belief
    /// is then as it was.
    pub fn predict_extended(&mut self, motion: &impl LinearizedMotion<N>, dt_s: f64) -> Result<()> {
        require_time_step(dt_s)?;
        let slope = motion.jacobian(self.mean(), dt_s);
        let noise = require_semi_definite("the process noise", &motion.noise(self.mean(), dt_s))?;
        *self = Self::computed(motion.advance(self.mean(), dt_s), sandwich(&slope, self.covariance()) + noise)?;
        Ok(())
    }

    /// Corrects the belief by the reading `value` of a nonlinear `sensor`, linearised at the mean; Joseph form.
    ///
    /// # Errors
    /// Where a number is not finite, the sensor's noise is not semi-definite, or the innovation covariance is singular;
    /// the belief is then as it was.
    pub fn update_extended<const M: usize>(
        &mut self,
        sensor: &impl LinearizedSensor<M, N>,
        value: &SVector<f64, M>,
    ) -> Result<Innovation<M>> {
        require_finite("the measurement", value)?;
        let tangent = LinearMeasurement::new(sensor.jacobian(self.mean()), sensor.noise())?;
        let found = corrected(self, &tangent, &sensor.difference(value, &sensor.expected(self.mean())))?;
        *self = found.belief;
        Ok(found.innovation)
    }
}
