//! Measuring a head: how late it is, how far a command turns it, how fast it gains speed, and how much play it has, from
//! small moves and from how the picture shifts.
//!
//! [`Calibrator`] is asked for commands and told of shifts; it never waits, so it runs beside whatever else a program does.
//! [`ShiftMeter`] measures shifts between pictures.

mod calibrator;
mod pulse;
mod shift;

pub use calibrator::{AxisFacts, Calibration, CalibrationParams, Calibrator, Step};
pub use pulse::Shift;
pub use shift::ShiftMeter;
