//! Constant velocity, watched for an acceleration.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use super::{PointFilter, PointStart, position_sensor};
use crate::filters::InputEstimator;
use crate::motion::ConstantVelocity;
use crate::{Gaussian, Innovation, MotionModel, Result};

/// Steps that are watched for the onset of an acceleration.
const WINDOW: usize = 10;

/// A point that moves at constant velocity until the last ten innovations tell of an acceleration, which is then put right.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct InputPoint {
    motion: ConstantVelocity<2>,
    threshold: f64,
    start: PointStart,
    filter: InputEstimator<2, 4, 2, WINDOW>,
}

impl InputPoint {
    /// A filter first seen at `position` with noise covariance `noise`. `threshold` is the χ² of two degrees of freedom that
    /// an acceleration must exceed; 9 is usual.
    ///
    /// # Errors
    /// Where a parameter is out of range or `noise` is not positive definite.
    pub fn new(
        motion: ConstantVelocity<2>,
        threshold: f64,
        start: PointStart,
        position: &SVector<f64, 2>,
        noise: &SMatrix<f64, 2, 2>,
    ) -> Result<Self> {
        let filter = InputEstimator::new(start.at(position, noise)?, threshold)?;
        Ok(Self { motion, threshold, start, filter })
    }
}

impl PointFilter for InputPoint {
    fn predict(&mut self, dt_s: f64) -> Result<()> {
        let (position, velocity) = (0.5 * dt_s * dt_s, dt_s);
        #[rustfmt::skip]
        let input = SMatrix::<f64, 4, 2>::new(
            position, 0.0,
            0.0, position,
            velocity, 0.0,
            0.0, velocity,
        );
        self.filter.predict(&self.motion.over(dt_s)?, &input)
    }

    fn update(&mut self, position: &SVector<f64, 2>, noise: &SMatrix<f64, 2, 2>) -> Result<Innovation<2>> {
        Ok(self.filter.update(&position_sensor(noise)?, position)?.0)
    }

    fn belief(&self) -> Gaussian<4> {
        *self.filter.belief()
    }

    fn forecast(&self, dt_s: f64) -> Result<Gaussian<4>> {
        self.filter.belief().predicted(&self.motion.over(dt_s)?)
    }

    fn restart(&mut self, position: &SVector<f64, 2>, noise: &SMatrix<f64, 2, 2>) -> Result<()> {
        *self = Self::new(self.motion, self.threshold, self.start, position, noise)?;
        Ok(())
    }
}
