//! Chains of integrators: random walk, constant velocity, constant acceleration, in one to four dimensions.

use nalgebra::SMatrix;
use serde::{Deserialize, Serialize};

use crate::error::{require, require_time_step};
use crate::{MotionModel, Result, Transition};

/// How noise enters a chain of integrators of order `K` (1 random walk, 2 constant velocity, 3 constant acceleration).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum KinematicNoise {
    /// White noise on the `K`-th derivative in continuous time, integrated exactly over the step: the choice for
    /// varying `dt`. For constant velocity `Q = q [[dt³/3, dt²/2], [dt²/2, dt]]` (Bar-Shalom, Li, Kirubarajan 2001, 6.2).
    White {
        /// Power spectral density `q` of the `K`-th derivative, units²·s^(1−2K): px²/s³ for constant velocity. ≥ 0.
        density: f64,
    },
    /// A `K`-th derivative that is constant during each step and independent between steps (same book, 6.3). For constant
    /// velocity `Q = s [[dt⁴/4, dt³/2], [dt³/2, dt²]]`: the form of `gao2007`.
    Piecewise {
        /// Variance `s` of the `K`-th derivative, (units/s^K)². ≥ 0.
        variance: f64,
    },
    /// `Q = s I` for every step whatever its length, as `qu2010` and `zhu2014` print it. Depends on the frame rate.
    PerStep {
        /// Variance `s` added to every component at each step, in the component's units squared. ≥ 0.
        variance: f64,
    },
}

/// `K` derivatives (position first) of a point in `D` dimensions, driven by noise in the highest.
///
/// Implements [`MotionModel`] of `D · K` components for `D` from 1 to 4 and `K` from 1 to 3.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Integrators<const D: usize, const K: usize> {
    /// Where the uncertainty of the motion comes from; the same for each axis, independent between axes.
    pub noise: KinematicNoise,
}

/// A position that wanders: state `[x, y, …]`.
pub type RandomWalk<const D: usize> = Integrators<D, 1>;
/// Constant velocity, disturbed: state `[x, y, …, vx, vy, …]`.
pub type ConstantVelocity<const D: usize> = Integrators<D, 2>;
/// Constant acceleration, disturbed: state `[x, y, …, vx, vy, …, ax, ay, …]`.
pub type ConstantAcceleration<const D: usize> = Integrators<D, 3>;

impl<const D: usize, const K: usize> Integrators<D, K> {
    /// A chain driven by white noise of power spectral density `density` (see [`KinematicNoise::White`]).
    pub const fn white(density: f64) -> Self {
        Self { noise: KinematicNoise::White { density } }
    }

    /// A chain driven by a highest derivative that is constant over each step (see [`KinematicNoise::Piecewise`]).
    pub const fn piecewise(variance: f64) -> Self {
        Self { noise: KinematicNoise::Piecewise { variance } }
    }

    /// A chain with `Q = variance · I` at each step (see [`KinematicNoise::PerStep`]).
    pub const fn per_step(variance: f64) -> Self {
        Self { noise: KinematicNoise::PerStep { variance } }
    }

    /// The transition for one axis: `F` and `Q`, `K × K`.
    #[inline]
    pub(crate) fn axis(&self, dt_s: f64) -> Result<(SMatrix<f64, K, K>, SMatrix<f64, K, K>)> {
        require_time_step(dt_s)?;
        let mut power = [1.0; HIGHEST];
        for n in 1..HIGHEST {
            power[n] = power[n - 1] * dt_s;
        }
        let matrix = SMatrix::from_fn(|i, j| if j >= i { power[j - i] / FACTORIAL[j - i] } else { 0.0 });
        let noise = match self.noise {
            KinematicNoise::White { density } => {
                require("density", density, density >= 0.0, "zero or more")?;
                // ∫ g gᵀ ds with g_i(s) = s^(K−1−i) / (K−1−i)!
                SMatrix::from_fn(|i, j| {
                    let (a, b) = (K - 1 - i, K - 1 - j);
                    density * power[a + b + 1] / (FACTORIAL[a] * FACTORIAL[b] * (a + b + 1) as f64)
                })
            }
            KinematicNoise::Piecewise { variance } => {
                require("variance", variance, variance >= 0.0, "zero or more")?;
                // g gᵀ with g_i = dt^(K−i) / (K−i)!
                SMatrix::from_fn(|i, j| {
                    let (a, b) = (K - i, K - j);
                    variance * power[a + b] / (FACTORIAL[a] * FACTORIAL[b])
                })
            }
            KinematicNoise::PerStep { variance } => {
                require("variance", variance, variance >= 0.0, "zero or more")?;
                SMatrix::from_diagonal_element(variance)
            }
        };
        Ok((matrix, noise))
    }
}

/// Powers of the step that chains of up to three integrators need, and one.
const HIGHEST: usize = 7;
const FACTORIAL: [f64; 4] = [1.0, 1.0, 2.0, 6.0];

/// Repeats a one-axis block over `axes` axes: component `k` of axis `d` is at `k · axes + d`.
#[inline]
pub(crate) fn spread<const N: usize, const K: usize>(block: &SMatrix<f64, K, K>, axes: usize) -> SMatrix<f64, N, N> {
    let mut out = SMatrix::<f64, N, N>::zeros();
    for column in 0..K {
        for row in 0..K {
            for axis in 0..axes {
                out.data.0[column * axes + axis][row * axes + axis] = block.data.0[column][row];
            }
        }
    }
    out
}

/// The state's length is a product that const generics cannot write yet, hence one line per combination.
macro_rules! integrator_models {
    ($($axes:literal $order:literal $length:literal;)*) => {$(
        impl MotionModel<$length> for Integrators<$axes, $order> {
            #[inline]
            fn over(&self, dt_s: f64) -> Result<Transition<$length>> {
                let (matrix, noise) = self.axis(dt_s)?;
                Transition::of_axes::<$order>(&matrix, &noise, $axes)
            }
        }
    )*};
}

integrator_models! {
    1 1 1; 2 1 2; 3 1 3; 4 1 4;
    1 2 2; 2 2 4; 3 2 6; 4 2 8;
    1 3 3; 2 3 6; 3 3 9; 4 3 12;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::EstimationError;

    #[test]
    fn two_half_steps_are_one_whole_step() {
        let model = ConstantAcceleration::<2>::white(0.7);
        let (half, whole) = (model.over(0.15).unwrap(), model.over(0.3).unwrap());
        let f = half.matrix() * half.matrix();
        let q = half.matrix() * half.noise() * half.matrix().transpose() + half.noise();
        assert!((f - whole.matrix()).norm() < 1e-15);
        assert!((q - whole.noise()).norm() < 1e-15);
    }

    #[test]
    fn textbook_matrices() {
        let (f, q) = ConstantVelocity::<1>::white(2.0).axis(0.5).unwrap();
        assert_eq!(f.as_slice(), [1.0, 0.0, 0.5, 1.0]);
        let expected = [2.0 * 0.125 / 3.0, 2.0 * 0.125, 2.0 * 0.125, 1.0];
        assert!(q.as_slice().iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15));
        let (_, q) = ConstantVelocity::<1>::piecewise(0.0025).axis(1.0).unwrap();
        assert_eq!(q.as_slice(), [0.0025 / 4.0, 0.0025 / 2.0, 0.0025 / 2.0, 0.0025]);
    }

    #[test]
    fn bad_steps_and_parameters_are_named() {
        let model = ConstantVelocity::<2>::white(1.0);
        for dt in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(matches!(model.over(dt), Err(EstimationError::TimeStep { .. })));
        }
        assert!(matches!(ConstantVelocity::<2>::white(-1.0).over(1.0), Err(EstimationError::Parameter { .. })));
    }
}
