use pursuit_imaging::Frame;
use pursuit_tracking::{Class, Estimate, TargetId, Track};

/// One line of a trajectory: what is known of one target in one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// Number of the frame in its video, from 0.
    pub frame: u64,
    /// Time of the frame in seconds.
    pub time_s: f64,
    /// The target; targets are numbered from 1 in the order they were given or found.
    pub target: TargetId,
    /// What it is, where a detector has said so.
    pub class: Option<Class>,
    /// What the tracker said; `None` while a detector is still looking for something to follow.
    pub estimate: Option<Estimate>,
    /// Milliseconds the tracker took, where it ran.
    pub update_ms: Option<f64>,
}

impl Record {
    /// Of one target in `frame`.
    pub fn new(frame: &Frame, track: Track) -> Self {
        Self {
            frame: frame.index(),
            time_s: frame.time_s(),
            target: track.id,
            class: track.class,
            estimate: track.estimate,
            update_ms: Some(track.elapsed.wall_ms),
        }
    }
}
