//! Filters of a point in the plane whose position is measured, all of one shape: what a tracker puts its motion into.
//!
//! Positions are in pixels (or any other unit), velocities per second, and every step is given in seconds. Each filter is a
//! value: cloneable, comparable and serialisable; one that is read back is whole.
//!
//! | filter | motion |
//! |---|---|
//! | [`ModelPoint`] | any one [`crate::Mode`]: constant velocity or acceleration, Singer, current statistical, a turn of known or estimated rate |
//! | [`ImmPoint`] | two to four modes, interacting |
//! | [`GatedPoint`] | `gao2007`, gated, one filter for each axis |
//! | [`HalfIntervalPoint`] | `zhu2014` |
//! | [`InputPoint`] | constant velocity with input estimation |

mod gated;
mod half_interval;
mod input;
mod interacting;
mod model;
mod start;

pub use gated::GatedPoint;
pub use half_interval::HalfIntervalPoint;
pub use input::InputPoint;
pub use interacting::{ImmPoint, Modes};
pub use model::ModelPoint;
pub use start::PointStart;

use nalgebra::{SMatrix, SVector};

use crate::{Gaussian, Innovation, LinearMeasurement, Result};

/// A filter of a point whose position is measured.
///
/// A frame is [`predict`](Self::predict), then [`update`](Self::update) where something was measured. After an error the
/// filter is as it was.
pub trait PointFilter {
    /// Moves the belief by `dt_s` seconds.
    ///
    /// # Errors
    /// Where `dt_s` is not positive and finite, a parameter of the motion is out of range or the result overflows.
    fn predict(&mut self, dt_s: f64) -> Result<()>;

    /// Corrects the belief by a measured `position`, px, with noise covariance `noise`, px². Returns what was not expected.
    ///
    /// # Errors
    /// Where a number is not finite, `noise` is not positive semi-definite, or the innovation covariance is singular.
    fn update(&mut self, position: &SVector<f64, 2>, noise: &SMatrix<f64, 2, 2>) -> Result<Innovation<2>>;

    /// The belief now about `[x, y, vx, vy]`, px and px/s.
    fn belief(&self) -> Gaussian<4>;

    /// The belief after `dt_s` seconds, as [`predict`](Self::predict) would leave it, leaving this one alone.
    ///
    /// # Errors
    /// As [`predict`](Self::predict).
    fn forecast(&self, dt_s: f64) -> Result<Gaussian<4>>;

    /// Starts again at a measured `position` with noise covariance `noise`, with velocity and all else unknown.
    ///
    /// # Errors
    /// Where a number is not finite or `noise` is not positive definite.
    fn restart(&mut self, position: &SVector<f64, 2>, noise: &SMatrix<f64, 2, 2>) -> Result<()>;

    /// The measurement expected now and its covariance `S = H P Hᵀ + R`: for gates and search windows.
    ///
    /// # Errors
    /// Where `noise` is not positive semi-definite.
    fn expected(&self, noise: &SMatrix<f64, 2, 2>) -> Result<Gaussian<2>> {
        let sensor = position_sensor::<4>(noise)?;
        let position = self.belief().project(sensor.matrix())?;
        Gaussian::computed(*position.mean(), position.covariance() + sensor.noise())
    }
}

/// The sensor of the first two of `N` components.
fn position_sensor<const N: usize>(noise: &SMatrix<f64, 2, 2>) -> Result<LinearMeasurement<2, N>> {
    LinearMeasurement::select([0, 1], [0.0, 0.0])?.with_noise(*noise)
}

/// Position and velocity of a longer state.
fn plane<const N: usize>(belief: &Gaussian<N>) -> Gaussian<4> {
    let covariance = SMatrix::from_fn(|r, c| belief.covariance()[(r, c)]);
    Gaussian::trusted(SVector::from_fn(|r, _| belief.mean()[r]), covariance)
}
