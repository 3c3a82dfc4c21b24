//! One way of moving.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use super::{PointFilter, PointStart, plane, position_sensor};
use crate::{Gaussian, Innovation, Mode, Result};

/// A point that moves as `Motion` says, over a state of `N` components `[x, y, vx, vy, …]`.
///
/// `ModelPoint<ConstantVelocity<2>, 4>`, `ModelPoint<ConstantAcceleration<2>, 6>`, `ModelPoint<Singer<2>, 6>`,
/// `ModelPoint<CurrentStatistical<2>, 6>` and `ModelPoint<Extended<CoordinatedTurn>, 5>` are the usual ones.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ModelPoint<Motion, const N: usize> {
    motion: Motion,
    start: PointStart,
    belief: Gaussian<N>,
}

impl<Motion: Mode<N>, const N: usize> ModelPoint<Motion, N> {
    /// A filter first seen at `position` with noise covariance `noise`.
    ///
    /// # Errors
    /// Where a number of `start` is out of range or `noise` is not positive definite.
    pub fn new(
        motion: Motion,
        start: PointStart,
        position: &SVector<f64, 2>,
        noise: &SMatrix<f64, 2, 2>,
    ) -> Result<Self> {
        const { assert!(N >= 4, "the state holds two positions and two velocities at least") };
        Ok(Self { motion, start, belief: start.at(position, noise)? })
    }

    /// The belief about the whole state.
    pub const fn state(&self) -> &Gaussian<N> {
        &self.belief
    }
}

impl<Motion: Mode<N>, const N: usize> PointFilter for ModelPoint<Motion, N> {
    fn predict(&mut self, dt_s: f64) -> Result<()> {
        self.belief = self.motion.predict(&self.belief, dt_s)?;
        Ok(())
    }

    fn update(&mut self, position: &SVector<f64, 2>, noise: &SMatrix<f64, 2, 2>) -> Result<Innovation<2>> {
        self.belief.update(&position_sensor(noise)?, position)
    }

    fn belief(&self) -> Gaussian<4> {
        plane(&self.belief)
    }

    fn forecast(&self, dt_s: f64) -> Result<Gaussian<4>> {
        Ok(plane(&self.motion.predict(&self.belief, dt_s)?))
    }

    fn restart(&mut self, position: &SVector<f64, 2>, noise: &SMatrix<f64, 2, 2>) -> Result<()> {
        self.belief = self.start.at(position, noise)?;
        Ok(())
    }
}
