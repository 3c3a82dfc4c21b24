//! Acceleration that forgets: Singer's model, and the "current" statistical model built on it.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use super::integrators::spread;
use crate::error::{require, require_time_step};
use crate::{Gaussian, Mode, MotionModel, Result, Transition};

/// Singer's model (IEEE Trans. AES 1970): acceleration is a first-order Markov process of correlation time `1 / α`.
/// State `[x, …, vx, …, ax, …]` in `D` dimensions; implements [`MotionModel`] of `3 D` components for `D` from 1 to 3.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Singer<const D: usize> {
    /// `α`, the reciprocal of the manoeuvre's correlation time, 1/s. > 0; about 0.05 for a lazy turn, 1 for gusts.
    pub rate_per_s: f64,
    /// `σ_m²`, the stationary variance of the acceleration, (px/s²)². ≥ 0.
    pub acceleration_variance: f64,
}

impl<const D: usize> Singer<D> {
    /// Singer's own prior: full acceleration `± max_acceleration` with probability `p_max` each, none with `p_none`,
    /// uniform in between: `σ_m² = a²/3 (1 + 4 p_max − p_none)`.
    pub fn from_prior(rate_per_s: f64, max_acceleration: f64, p_max: f64, p_none: f64) -> Self {
        let acceleration_variance = max_acceleration * max_acceleration / 3.0 * (1.0 + 4.0 * p_max - p_none);
        Self { rate_per_s, acceleration_variance }
    }
}

/// `F` and `Q / σ_m²` of one axis.
fn axis(rate: f64, dt_s: f64) -> Result<(SMatrix<f64, 3, 3>, SMatrix<f64, 3, 3>)> {
    require_time_step(dt_s)?;
    require("rate_per_s", rate, rate > 0.0, "positive")?;
    let [position, velocity, acceleration] = impulse_response(rate, dt_s);
    #[rustfmt::skip]
    let matrix = SMatrix::<f64, 3, 3>::new(
        1.0, dt_s, position,
        0.0, 1.0, velocity,
        0.0, 0.0, acceleration,
    );
    let noise = if rate * dt_s < CLOSED_FORM_FROM { quadrature(rate, dt_s) } else { closed_form(rate, dt_s) };
    Ok((matrix, noise))
}

/// What a unit of acceleration now has become after `s`: `[(e⁻ᵃˢ − 1 + as)/a², (1 − e⁻ᵃˢ)/a, e⁻ᵃˢ]`.
fn impulse_response(rate: f64, s: f64) -> [f64; 3] {
    let x = rate * s;
    let shrunk = -(-x).exp_m1();
    // (e⁻ˣ − 1 + x)/x² cancels for small x: a series there.
    let second = if x < 0.5 {
        let mut term = 0.5;
        let mut sum = term;
        for n in 3..18 {
            term *= -x / f64::from(n);
            sum += term;
        }
        sum
    } else {
        (x - shrunk) / (x * x)
    };
    [s * s * second, shrunk / rate, (-x).exp()]
}

/// Where `αT` is at least this the closed form keeps 14 digits; below, its terms cancel (5 % of `Q` is lost at
/// `α = .05`, `T = 1/30`).
const CLOSED_FORM_FROM: f64 = 1.0;

/// `2 α ∫ g gᵀ ds` by ten-point Gauss-Legendre: a sum of positive terms, exact to rounding for `αT < 1` because the
/// integrand is nearly a polynomial of low degree.
fn quadrature(rate: f64, dt_s: f64) -> SMatrix<f64, 3, 3> {
    const NODES: [(f64, f64); 5] = [
        (0.148_874_338_981_631_21, 0.295_524_224_714_752_87),
        (0.433_395_394_129_247_2, 0.269_266_719_309_996_35),
        (0.679_409_568_299_024_4, 0.219_086_362_515_982_04),
        (0.865_063_366_688_984_5, 0.149_451_349_150_580_6),
        (0.973_906_528_517_171_7, 0.066_671_344_308_688_14),
    ];
    let mut noise = SMatrix::<f64, 3, 3>::zeros();
    for (node, weight) in NODES {
        for side in [-node, node] {
            let g = SVector::from(impulse_response(rate, 0.5 * dt_s * (1.0 + side)));
            noise += g * g.transpose() * (0.5 * dt_s * weight);
        }
    }
    noise * (2.0 * rate)
}

/// Singer's printed `Q` (Bar-Shalom, Li, Kirubarajan 2001, 8.2.3), for `αT` not small.
fn closed_form(rate: f64, dt_s: f64) -> SMatrix<f64, 3, 3> {
    let x = rate * dt_s;
    let (e1, e2) = ((-x).exp(), (-2.0 * x).exp());
    let pp = (1.0 - e2 + 2.0 * x + 2.0 * x.powi(3) / 3.0 - 2.0 * x * x - 4.0 * x * e1) / rate.powi(4);
    let pv = (e2 + 1.0 - 2.0 * e1 + 2.0 * x * e1 - 2.0 * x + x * x) / rate.powi(3);
    let pa = (1.0 - e2 - 2.0 * x * e1) / (rate * rate);
    let vv = (4.0 * e1 - 3.0 - e2 + 2.0 * x) / (rate * rate);
    let va = (e2 + 1.0 - 2.0 * e1) / rate;
    SMatrix::<f64, 3, 3>::new(pp, pv, pa, pv, vv, va, pa, va, 1.0 - e2)
}

/// The "current" statistical model (Zhou and Kumar 1984): Singer's model about the acceleration estimated now, with a
/// variance that shrinks as that estimate nears the largest possible, `σ² = (4 − π)/π (a_max − |a|)²`.
///
/// Its transition depends on the state, so it is asked with [`over_from`](Self::over_from). A `max_acceleration` below
/// what the target really does makes the filter diverge: choose it generously.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CurrentStatistical<const D: usize> {
    /// `α`, the reciprocal of the manoeuvre's correlation time, 1/s. > 0.
    pub rate_per_s: f64,
    /// `a_max`, the largest acceleration of an axis, px/s². > 0.
    pub max_acceleration: f64,
}

impl<const D: usize> CurrentStatistical<D> {
    /// `F`, the per-axis displacement towards the mean acceleration, and `Q / σ²`, of one axis.
    fn parts(&self, dt_s: f64) -> Result<(SMatrix<f64, 3, 3>, SVector<f64, 3>, SMatrix<f64, 3, 3>)> {
        require("max_acceleration", self.max_acceleration, self.max_acceleration > 0.0, "positive")?;
        let (matrix, noise) = axis(self.rate_per_s, dt_s)?;
        // U = what a constant acceleration of one does, less what the Markov part already carries.
        let steady = SVector::from([0.5 * dt_s * dt_s, dt_s, 1.0]);
        Ok((matrix, steady - matrix.column(2), noise))
    }

    /// `σ²` for an axis whose acceleration is estimated as `acceleration`.
    fn variance(&self, acceleration: f64) -> f64 {
        use std::f64::consts::PI;
        let room = self.max_acceleration - acceleration.abs();
        (4.0 - PI) / PI * room * room
    }
}

macro_rules! singer_models {
    ($($axes:literal $length:literal;)*) => {$(
        impl MotionModel<$length> for Singer<$axes> {
            fn over(&self, dt_s: f64) -> Result<Transition<$length>> {
                let variance = self.acceleration_variance;
                require("acceleration_variance", variance, variance >= 0.0, "zero or more")?;
                let (matrix, noise) = axis(self.rate_per_s, dt_s)?;
                Transition::of_axes::<3>(&matrix, &(noise * variance), $axes)
            }
        }

        impl CurrentStatistical<$axes> {
            /// The transition over the next `dt_s` seconds of a target now in `state`.
            ///
            /// # Errors
            /// Where `dt_s` is not positive and finite, or a parameter or the state is out of range.
            pub fn over_from(&self, state: &SVector<f64, $length>, dt_s: f64) -> Result<Transition<$length>> {
                let (matrix, input, noise) = self.parts(dt_s)?;
                let mut full = spread::<$length, 3>(&noise, $axes);
                let mut offset = SVector::<f64, $length>::zeros();
                for axis in 0..$axes {
                    let acceleration = state[2 * $axes + axis];
                    for order in 0..3 {
                        let row = order * $axes + axis;
                        offset[row] = input[order] * acceleration;
                        full.row_mut(row).scale_mut(self.variance(acceleration));
                    }
                }
                Transition::computed(spread(&matrix, $axes), full)?.with_offset(offset)
            }
        }
    )*};
}

singer_models! { 1 3; 2 6; 3 9; }

/// In an interacting estimator the model looks at the acceleration that the mixture of the modes says.
macro_rules! current_modes {
    ($($axes:literal $length:literal;)*) => {$(
        impl Mode<$length> for CurrentStatistical<$axes> {
            fn predict(&self, belief: &Gaussian<$length>, dt_s: f64) -> Result<Gaussian<$length>> {
                belief.predicted(&self.over_from(belief.mean(), dt_s)?)
            }
        }
    )*};
}

current_modes! { 1 3; 2 6; 3 9; }

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::ConstantAcceleration;

    #[test]
    fn both_forms_of_the_noise_agree_where_both_are_accurate() {
        let (a, b) = (quadrature(1.0, 1.0), closed_form(1.0, 1.0));
        assert!((a - b).norm() < 1e-14, "{}", a - b);
    }

    #[test]
    fn half_steps_compose() {
        for rate in [1e-4, 0.3, 3.0, 40.0] {
            let model = Singer::<2> { rate_per_s: rate, acceleration_variance: 2.0 };
            let (half, whole) = (model.over(0.5).unwrap(), model.over(1.0).unwrap());
            assert!((half.matrix() * half.matrix() - whole.matrix()).norm() < 1e-13);
            let q = half.matrix() * half.noise() * half.matrix().transpose() + half.noise();
            assert!((q - whole.noise()).norm() < 1e-12 * whole.noise().norm(), "rate {rate}");
        }
    }

    #[test]
    fn the_current_model_moves_its_mean_as_constant_acceleration_does() {
        let model = CurrentStatistical::<2> { rate_per_s: 0.7, max_acceleration: 30.0 };
        let state = SVector::from([1.0, 2.0, 3.0, 4.0, 5.0, -6.0]);
        let step = model.over_from(&state, 0.3).unwrap();
        let moved = step.matrix() * state + step.offset();
        let plain = ConstantAcceleration::<2>::white(1.0).over(0.3).unwrap();
        assert!((moved - plain.matrix() * state).norm() < 1e-13);
        // More room on the slower axis.
        assert!(step.noise()[(0, 0)] > step.noise()[(1, 1)]);
    }
}
