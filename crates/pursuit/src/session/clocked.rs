//! How long detectors take.

use crate::run::{Timing, TimingSummary};
use pursuit_geometry::BBox;
use pursuit_imaging::{Frame, Image};
use pursuit_tracking::many::{Elapsed, WallClock};
use pursuit_tracking::motion::MotionParams;
use pursuit_tracking::{Detection, Detector, Diagnostics, Followed, Result};
use std::sync::{Arc, Mutex, PoisonError};

/// The times of all detectors of a session, which targets own while they are asked.
#[derive(Clone, Default)]
pub(super) struct DetectionTimes(Arc<Mutex<Timing>>);

impl DetectionTimes {
    pub fn summary(&self) -> TimingSummary {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).summary()
    }

    /// The detector, its time taken at each call.
    pub fn of(&self, detector: Box<dyn Detector>) -> Box<dyn Detector> {
        Box::new(Clocked { detector, times: self.clone() })
    }
}

struct Clocked {
    detector: Box<dyn Detector>,
    times: DetectionTimes,
}

impl Detector for Clocked {
    fn detect(&mut self, frame: &Frame, followed: &[Followed]) -> Result<Vec<Detection>> {
        let (found, took) = Elapsed::of(&WallClock::default(), || self.detector.detect(frame, followed));
        self.times.0.lock().unwrap_or_else(PoisonError::into_inner).add(took.wall_ms);
        found
    }

    fn watches(&self) -> bool {
        self.detector.watches()
    }

    fn measures(&self) -> bool {
        self.detector.measures()
    }

    fn standing_out(&self, bbox: &BBox) -> Option<f64> {
        self.detector.standing_out(bbox)
    }

    fn foreground(&mut self) -> Option<Arc<Image<u8>>> {
        self.detector.foreground()
    }

    fn shown(&mut self, frame: &Frame) -> Option<Frame> {
        self.detector.shown(frame)
    }

    fn motion(&self) -> Option<MotionParams> {
        self.detector.motion()
    }

    fn diagnostics(&self) -> Diagnostics {
        self.detector.diagnostics()
    }
}
