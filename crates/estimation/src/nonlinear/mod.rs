//! Nonlinear motion and sensors, and the two filters that linearise them: by slope (extended, the `*_extended` methods of
//! [`crate::Gaussian`]) and by sample points (unscented, the `*_unscented` methods).

mod extended;
mod linearised;
mod unscented;

use nalgebra::{SMatrix, SVector};

pub use unscented::{SigmaPoints, Unscented};

/// Motion `x ← f(x, dt) + w`, `w ~ N(0, Q(x, dt))`.
pub trait NonlinearMotion<const N: usize> {
    /// `f`: the state after `dt_s` seconds, without noise.
    fn advance(&self, state: &SVector<f64, N>, dt_s: f64) -> SVector<f64, N>;

    /// `Q`: the covariance of the noise gathered over `dt_s` seconds, symmetric and positive semi-definite.
    fn noise(&self, state: &SVector<f64, N>, dt_s: f64) -> SMatrix<f64, N, N>;
}

/// Motion whose slope is known: what the extended filter needs.
pub trait LinearizedMotion<const N: usize>: NonlinearMotion<N> {
    /// `∂f/∂x` at `state`.
    fn jacobian(&self, state: &SVector<f64, N>, dt_s: f64) -> SMatrix<f64, N, N>;
}

/// A sensor `z = h(x) + v`, `v ~ N(0, R)`.
pub trait NonlinearSensor<const M: usize, const N: usize> {
    /// `h`: what the sensor would read in `state`, without noise.
    fn expected(&self, state: &SVector<f64, N>) -> SVector<f64, M>;

    /// `R`: the covariance of the noise, symmetric and positive semi-definite.
    fn noise(&self) -> SMatrix<f64, M, M>;

    /// The difference `a − b` of two readings. Override it where a component is an angle, and wrap it there.
    fn difference(&self, a: &SVector<f64, M>, b: &SVector<f64, M>) -> SVector<f64, M> {
        a - b
    }
}

/// A sensor whose slope is known: what the extended filter needs.
pub trait LinearizedSensor<const M: usize, const N: usize>: NonlinearSensor<M, N> {
    /// `∂h/∂x` at `state`.
    fn jacobian(&self, state: &SVector<f64, N>) -> SMatrix<f64, M, N>;
}
