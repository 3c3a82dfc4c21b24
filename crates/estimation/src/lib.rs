//! Estimating the state of something that moves from measurements that err.
//!
//! Floor 0 of the project: this crate knows nothing of images. States and measurements are vectors whose sizes are
//! known at compile time, all arithmetic is `f64`, no step allocates, and time is always an argument in **seconds**.
//!
//! ```
//! use nalgebra::{vector, SVector};
//! use pursuit_estimation::{Gaussian, LinearMeasurement, MotionModel, motion::ConstantVelocity};
//!
//! # fn main() -> pursuit_estimation::Result<()> {
//! let model = ConstantVelocity::<2>::white(50.0); // px²/s³
//! let sensor = LinearMeasurement::<2, 4>::select([0, 1], [1.0, 1.0])?; // px²
//! let mut belief = Gaussian::from_variances(vector![10.0, 20.0, 0.0, 0.0], vector![1.0, 1.0, 1e4, 1e4])?;
//!
//! belief.predict(&model.over(1.0 / 30.0)?)?;
//! let innovation = belief.update(&sensor, &vector![12.0, 20.5])?;
//! assert!(innovation.nis() < 9.21);
//! // A frame without a measurement is a prediction only; a slower frame is a longer step.
//! belief.predict(&model.over(0.1)?)?;
//! assert!(belief.mean()[0] > 12.0);
//! # Ok(())
//! # }
//! ```
//!
//! An error, whatever its kind, leaves the belief as it was.

pub mod association;
mod checked;
pub mod consistency;
mod correction;
mod error;
pub mod filters;
pub mod fitting;
mod gaussian;
mod imm;
mod matrix;
mod measurement;
pub mod motion;
pub mod nonlinear;
mod odds;
pub mod papers;
pub mod particle;
pub mod point;
mod prediction;
pub mod regression;
mod sharp;
mod transition;

pub use error::{EstimationError, Result};
pub use gaussian::Gaussian;
pub use imm::{Embedded, Extended, Imm, Mode, Sojourn, Switching, UnscentedMode};
pub use measurement::{Innovation, LinearMeasurement};
pub use nalgebra;
pub use odds::{logit, sigmoid};
pub use papers::{gao2007, qu2010, zhai2024, zhu2014};
pub use rand_pcg;
pub use transition::{MotionModel, Transition};

/// The README's example is run with the documentation's own.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
