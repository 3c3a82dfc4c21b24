//! Motion along circles: a known turn rate, or one that is estimated with the state.
//!
//! Turn rates are in rad/s. With y down (image coordinates) a positive rate turns clockwise on the screen: velocity
//! `(1, 0)` moves towards `(0, 1)`.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use crate::error::{require, require_time_step};
use crate::nonlinear::{LinearizedMotion, NonlinearMotion};
use crate::{MotionModel, Result, Transition};

/// A turn at a known rate, disturbed by white-noise acceleration: linear, state `[x, y, vx, vy]`. Several of these are
/// the classic modes of an interacting multiple model filter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct KnownTurn {
    /// Turn rate, rad/s. Zero is constant velocity.
    pub rate_rad_per_s: f64,
    /// Power spectral density of the acceleration of each axis, px²/s³. ≥ 0.
    pub acceleration_density: f64,
}

impl MotionModel<4> for KnownTurn {
    fn over(&self, dt_s: f64) -> Result<Transition<4>> {
        require_time_step(dt_s)?;
        require("rate_rad_per_s", self.rate_rad_per_s, true, "finite")?;
        require("acceleration_density", self.acceleration_density, self.acceleration_density >= 0.0, "zero or more")?;
        Transition::computed(turn_matrix(self.rate_rad_per_s, dt_s), self.noise(dt_s))
    }
}

impl KnownTurn {
    /// `Q = q ∫ F(s) G Gᵀ F(s)ᵀ ds`: a rotation leaves white noise white, so only position and the cross terms change.
    fn noise(&self, dt_s: f64) -> SMatrix<f64, 4, 4> {
        let angle = self.rate_rad_per_s * dt_s;
        let q = self.acceleration_density;
        let (position, along) = (q * dt_s.powi(3) * 2.0 * third(angle), q * dt_s * dt_s * second(angle));
        let (across, velocity) = (q * dt_s * dt_s * angle * third(angle), q * dt_s);
        #[rustfmt::skip]
        let noise = SMatrix::<f64, 4, 4>::new(
            position, 0.0, along, across,
            0.0, position, -across, along,
            along, -across, velocity, 0.0,
            across, along, 0.0, velocity,
        );
        noise
    }
}

/// A turn whose rate is part of the state, `[x, y, vx, vy, ω]`: nonlinear, for the extended and unscented filters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CoordinatedTurn {
    /// Power spectral density of the acceleration of each axis, px²/s³. ≥ 0.
    pub acceleration_density: f64,
    /// Growth of the turn rate's variance, rad²/s³. ≥ 0.
    pub turn_density: f64,
}

impl NonlinearMotion<5> for CoordinatedTurn {
    fn advance(&self, state: &SVector<f64, 5>, dt_s: f64) -> SVector<f64, 5> {
        let moved = turn_matrix(state[4], dt_s) * state.fixed_rows::<4>(0);
        SVector::from([moved[0], moved[1], moved[2], moved[3], state[4]])
    }

    fn noise(&self, state: &SVector<f64, 5>, dt_s: f64) -> SMatrix<f64, 5, 5> {
        let turn = KnownTurn { rate_rad_per_s: state[4], acceleration_density: self.acceleration_density };
        let mut noise = SMatrix::<f64, 5, 5>::zeros();
        noise.fixed_view_mut::<4, 4>(0, 0).copy_from(&turn.noise(dt_s));
        noise[(4, 4)] = self.turn_density * dt_s;
        noise
    }
}

impl LinearizedMotion<5> for CoordinatedTurn {
    fn jacobian(&self, state: &SVector<f64, 5>, dt_s: f64) -> SMatrix<f64, 5, 5> {
        let angle = state[4] * dt_s;
        let (vx, vy) = (state[2], state[3]);
        let mut matrix = SMatrix::<f64, 5, 5>::identity();
        matrix.fixed_view_mut::<4, 4>(0, 0).copy_from(&turn_matrix(state[4], dt_s));
        // d/dω of dt·sin θ/θ and dt·(1−cos θ)/θ, θ = ω dt.
        let (sine, cosine) = angle.sin_cos();
        let d_sine = dt_s * dt_s * angle * (third(angle) - second(angle));
        let d_cosine = dt_s * dt_s * (first(angle) - second(angle));
        matrix[(0, 4)] = d_sine * vx - d_cosine * vy;
        matrix[(1, 4)] = d_cosine * vx + d_sine * vy;
        matrix[(2, 4)] = dt_s * (-sine * vx - cosine * vy);
        matrix[(3, 4)] = dt_s * (cosine * vx - sine * vy);
        matrix
    }
}

/// `F` of a turn at `rate` over `dt`, state `[x, y, vx, vy]`.
fn turn_matrix(rate: f64, dt_s: f64) -> SMatrix<f64, 4, 4> {
    let angle = rate * dt_s;
    let (sine, cosine) = angle.sin_cos();
    let (along, across) = (dt_s * first(angle), dt_s * angle * second(angle));
    #[rustfmt::skip]
    let matrix = SMatrix::<f64, 4, 4>::new(
        1.0, 0.0, along, -across,
        0.0, 1.0, across, along,
        0.0, 0.0, cosine, -sine,
        0.0, 0.0, sine, cosine,
    );
    matrix
}

/// `sin θ / θ`.
fn first(angle: f64) -> f64 {
    if angle.abs() < 1e-4 { 1.0 - angle * angle / 6.0 } else { angle.sin() / angle }
}

/// `(1 − cos θ) / θ²`, without the cancellation of `1 − cos`.
fn second(angle: f64) -> f64 {
    let half = first(0.5 * angle);
    0.5 * half * half
}

/// `(θ − sin θ) / θ³`; a series where the difference would cancel.
fn third(angle: f64) -> f64 {
    if angle.abs() > 1.0 {
        return (angle - angle.sin()) / angle.powi(3);
    }
    let square = angle * angle;
    let mut term = 1.0 / 6.0;
    let mut sum = term;
    for n in 2..12 {
        term *= -square / f64::from((2 * n) * (2 * n + 1));
        sum += term;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::ConstantVelocity;

    #[test]
    fn no_turn_is_constant_velocity() {
        let straight = ConstantVelocity::<2>::white(3.0).over(0.2).unwrap();
        for rate in [0.0, 1e-9, -1e-9] {
            let turn = KnownTurn { rate_rad_per_s: rate, acceleration_density: 3.0 }.over(0.2).unwrap();
            assert!((turn.matrix() - straight.matrix()).norm() < 1e-8);
            assert!((turn.noise() - straight.noise()).norm() < 1e-8);
        }
    }

    #[test]
    fn half_steps_compose() {
        for rate in [0.01, -0.7, 4.0] {
            let model = KnownTurn { rate_rad_per_s: rate, acceleration_density: 2.0 };
            let (half, whole) = (model.over(0.5).unwrap(), model.over(1.0).unwrap());
            assert!((half.matrix() * half.matrix() - whole.matrix()).norm() < 1e-14);
            let q = half.matrix() * half.noise() * half.matrix().transpose() + half.noise();
            assert!((q - whole.noise()).norm() < 1e-14, "rate {rate}");
        }
    }

    #[test]
    fn jacobian_is_the_slope() {
        let model = CoordinatedTurn { acceleration_density: 1.0, turn_density: 0.1 };
        for rate in [1e-7, 0.3, -2.0] {
            let state = SVector::from([5.0, -3.0, 12.0, 7.0, rate]);
            let slope = model.jacobian(&state, 0.4);
            for j in 0..5 {
                let step = 1e-5;
                let mut ahead = state;
                ahead[j] += step;
                let mut behind = state;
                behind[j] -= step;
                let numeric = (model.advance(&ahead, 0.4) - model.advance(&behind, 0.4)) / (2.0 * step);
                assert!((slope.column(j) - numeric).norm() < 1e-8, "rate {rate}, column {j}");
            }
        }
    }
}
