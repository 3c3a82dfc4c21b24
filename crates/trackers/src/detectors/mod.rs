//! Detectors that belong to no tracker.

pub mod motion;
pub mod objects;
