//! Detectors that belong to no tracker.

pub mod flow;
pub mod motion;
pub mod objects;
