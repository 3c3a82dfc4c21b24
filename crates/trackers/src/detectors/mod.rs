//! Detectors that belong to no tracker.

pub mod flow;
pub mod motion;
pub mod moving_objects;
pub mod objects;
