//! What a detector sees in the frame that is shown: boxes to begin from.

use super::run_up::RunUp;
use crate::error::Refusal;
use crate::root::Root;
use pursuit::parameters::nested;
use pursuit::toml::Table;

use pursuit::revise::{ChosenDetector, Frames};
use pursuit::trackers::registry;
use pursuit::tracking::{Detection, Detector, Followed};
use pursuit::{BBox, Frame, RunError};

/// A detector by name.
///
/// # Errors
/// A name that there is not, parameters that do not fit or name files outside the root.
pub(crate) fn seeking(name: &str, parameters: &Table, root: &Root) -> Result<ChosenDetector, Refusal> {
    let mut parameters = nested(parameters);
    root.hold(&registry::detector(name).map_err(RunError::from)?.schema(), &mut parameters)?;
    Ok(ChosenDetector::new(name, parameters)?)
}

/// A detector that is asked about frames in any order.
pub(crate) struct Proposer {
    pub seeking: ChosenDetector,
    detector: Box<dyn Detector>,
    /// The frame asked about last, and what was seen in it, the best first.
    seen: Option<u64>,
    found: Vec<Detection>,
}

impl Proposer {
    /// # Errors
    /// As [`ChosenDetector::detector`].
    pub fn new(seeking: ChosenDetector) -> Result<Self, RunError> {
        let detector = seeking.detector()?;
        Ok(Self { seeking, detector, seen: None, found: Vec::new() })
    }

    /// What it sees in this frame, best first; empty for one that it was not asked about.
    pub fn boxes(&self, frame: u64) -> impl Iterator<Item = (BBox, f64)> {
        let found = if self.seen == Some(frame) { self.found.as_slice() } else { &[] };
        found.iter().map(|d| (d.bbox, d.confidence))
    }

    /// Asks it about this frame, in which these targets are. One that models the scene is shown the frames before as well, as
    /// far as they can be had.
    ///
    /// # Errors
    /// A frame that it cannot use, an input that cannot be read again.
    pub fn look(&mut self, frame: &Frame, followed: &[Followed], pictures: &mut Frames) -> Result<(), RunError> {
        let at = frame.index();
        if self.seen == Some(at) {
            return Ok(());
        }
        if self.detector.watches() {
            let next = match RunUp::to(at, self.seen.take()) {
                RunUp::GoOn(next) => next,
                RunUp::Anew(first) => {
                    self.detector = self.seeking.detector()?;
                    first
                }
            };
            for before in next..at {
                if let Some(frame) = pictures.get(before)? {
                    self.detector.detect(&frame.undecorated(), &[])?;
                }
            }
        }
        // Planes derived for this alone are not kept.
        self.found = self.detector.detect(&frame.undecorated(), followed)?;
        self.found.retain(|d| d.bbox.is_finite() && d.bbox.area() > 0.0);
        self.seen = Some(at);
        Ok(())
    }
}
