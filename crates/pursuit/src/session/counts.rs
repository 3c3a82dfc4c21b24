use super::age::Age;
use super::clocked::DetectionTimes;
use crate::run::{StateCounts, Timing, TimingFacts};
use pursuit_imaging::Frame;
use pursuit_tracking::{Track, TrackState};

/// What is counted of a session, and how long everything takes.
#[derive(Default)]
pub(super) struct Counts {
    pub states: StateCounts,
    update: Timing,
    /// Of the detector, where there is one.
    pub detect: DetectionTimes,
    pub look: Timing,
    pub decode: Timing,
    pub age: Age,
    latency: Timing,
    /// When the frame in hand was captured, as far as anybody knows, seconds since the session began.
    captured_s: f64,
    pub frames: u64,
}

impl Counts {
    /// A frame was taken at this second of the session.
    pub fn taken(&mut self, at_s: f64, frame: &Frame, is_live: bool) {
        let age_ms = if is_live { self.age.take(at_s, frame.time_s()) } else { 0.0 };
        self.captured_s = at_s - 1e-3 * age_ms;
    }

    /// A target was followed, or started, in the frame.
    pub fn followed(&mut self, track: &Track) {
        self.states.add(track.estimate.as_ref().map_or(TrackState::Lost, |e| e.state));
        if track.estimate.is_some() && !track.started {
            self.update.add(track.elapsed.wall_ms);
        }
    }

    /// All sinks have the frame's results at this second of the session.
    pub fn handed_on(&mut self, at_s: f64) {
        self.latency.add(1e3 * (at_s - self.captured_s));
    }

    /// The times, of a session that took so many seconds.
    pub fn timing(&self, total_s: f64) -> TimingFacts {
        TimingFacts {
            update_ms: self.update.summary(),
            detect_ms: self.detect.summary(),
            frame_ms: self.look.summary(),
            decode_ms: self.decode.summary(),
            latency_ms: self.latency.summary(),
            total_s,
        }
    }
}
