use super::Damage;
use crate::run::{StateCounts, TimingFacts, TimingSummary};
use crate::{Record, RunError};
use pursuit_imaging::Frame;
use std::sync::Arc;

/// What is known after a step.
#[derive(Debug, Clone, Copy)]
pub struct Progress<'a> {
    /// Frames looked at so far.
    pub frames: u64,
    /// The frame looked at.
    pub frame: &'a Arc<Frame>,
    /// What is known of each target in this frame, in order of their ids.
    pub records: &'a [Record],
}

/// How a session ended.
#[derive(Debug)]
pub struct Outcome {
    /// Frames looked at.
    pub frames: u64,
    /// Frames of all targets by state.
    pub states: StateCounts,
    /// How long things took.
    pub timing: TimingFacts,
    /// How much later than the promptest frame, by their own times, frames were taken up; of live sources alone.
    pub age_ms: TimingSummary,
    /// Whether it was stopped from outside.
    pub interrupted: bool,
    /// What was damaged in the input and left out.
    pub damage: Damage,
    /// What ended it early – a broken input, an output that cannot be written –, else the first damage.
    pub failure: Option<RunError>,
}
