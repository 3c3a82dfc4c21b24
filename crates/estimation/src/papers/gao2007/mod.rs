//! `gao2007`: a Kalman filter whose transition is estimated by least-squares support vector regression over the last few
//! states, for targets that manoeuvre in thermal sequences.
//!
//! Both forms work on **one axis** (state `[position, velocity]`), as the paper does; a tracker holds one per axis.
//! [`GatedFilter`] is the default: it reproduces what the paper promises without its division. [`LiteralFilter`] is the
//! paper as printed.

mod gated;
mod literal;
mod params;

pub use gated::GatedFilter;
pub use literal::LiteralFilter;
pub use params::{AccelerationNoise, GatedParams, LiteralParams, RatioGuard, VelocityReading};

use crate::motion::ConstantVelocity;
use crate::{Gaussian, LinearMeasurement, Result};
use nalgebra::{SMatrix, SVector};

/// What both filters start from: `x₀ = z₀`, a first velocity, `P₀ = I`.
fn start(position: f64, velocity: f64) -> Result<Gaussian<2>> {
    Gaussian::new(SVector::from([position, velocity]), SMatrix::identity())
}

/// `Q = q [[T⁴/4, T³/2], [T³/2, T²]]`.
const fn motion(acceleration_variance: f64) -> ConstantVelocity<1> {
    ConstantVelocity::piecewise(acceleration_variance)
}

/// A sensor of the position.
fn sensor(measurement_variance: f64) -> Result<LinearMeasurement<1, 2>> {
    LinearMeasurement::select([0], [measurement_variance])
}
