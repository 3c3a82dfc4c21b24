//! Every tracker and detector by name: the one list that the command line, the conformance suite, the benches and the
//! documentation read. A new tracker is its module and its entry in `lib.rs`.

use crate::ball::BallDetectorParams;
use crate::detectors::flow::{self, FlowDetectorParams};
use crate::detectors::motion::{self, MotionDetectorParams, PaperParams};
use crate::detectors::moving_objects::{self, MovingObjectsParams};
use crate::detectors::objects::{self, ObjectsParams};
use crate::families::family_of;
use pursuit_tracking::many::ManyParams;
use pursuit_tracking::registry::unknown;
use pursuit_tracking::{DetectorEntry, Result, TrackerEntry, TrackingError};

/// The tracker used where none is named.
pub const DEFAULT_TRACKER: &str = "pursuit";

/// Every tracker.
pub const fn trackers() -> &'static [TrackerEntry] {
    crate::TRACKERS
}

/// The trackers that need no file of the user's: those that start with their default parameters.
pub fn ready() -> impl Iterator<Item = &'static TrackerEntry> {
    trackers().iter().filter(|t| !t.default_recipe().needs().file)
}

/// Every detector.
pub const fn detectors() -> &'static [DetectorEntry] {
    const DETECTORS: &[DetectorEntry] = &[
        DetectorEntry::of::<BallDetectorParams>(
            "ball",
            "round regions of a given colour, or of any strong colour",
            "ball",
            crate::ball::detected_motion,
        ),
        DetectorEntry::of::<MotionDetectorParams>(
            "motion",
            "whatever moves, or has moved, in front of a camera that stands still",
            "person",
            motion::detected_motion,
        ),
        DetectorEntry::of::<PaperParams>(
            "qu2010",
            "the same as the paper has it: against the first frame, with nothing that was added since",
            "person",
            motion::detected_motion,
        ),
        DetectorEntry::of::<FlowDetectorParams>(
            "flow",
            "whatever moves against the scene in front of a camera that moves itself",
            "pursuit",
            flow::detected_motion,
        ),
        DetectorEntry::of::<ObjectsParams>(
            "objects",
            "people, cars, animals … by a network of yours (an ONNX file, YOLOX or described beside it), under any camera",
            "pursuit",
            objects::detected_motion,
        ),
        DetectorEntry::of::<MovingObjectsParams>(
            "moving-objects",
            "objects that move in front of a camera that stands still: motion proposes, a network of yours confirms and names every few frames",
            "person",
            moving_objects::detected_motion,
        ),
    ];
    DETECTORS
}

/// The detectors that need no file of the user's: those that start with their default parameters.
pub fn ready_detectors() -> impl Iterator<Item = &'static DetectorEntry> {
    detectors().iter().filter(|d| !d.needs.file)
}

/// How what a detector finds is made into targets, unless the user says otherwise.
pub fn many(detector: &DetectorEntry) -> ManyParams {
    let motion = detector.motion();
    // Networks of objects say chances; what the other detectors say are shares.
    if detector.name == "objects" {
        ManyParams { motion, ..ManyParams::default() }
    } else {
        ManyParams::counting(motion)
    }
}

/// The tracker called `name`.
///
/// # Errors
/// [`UnknownName`](TrackingError::UnknownName) with the names there are; [`NotBuiltIn`](TrackingError::NotBuiltIn) with the feature
/// that brings it.
pub fn tracker(name: &str) -> Result<&'static TrackerEntry> {
    let found = trackers().iter().find(|e| e.name == name);
    found.ok_or_else(|| match family_of(name) {
        // The table of families has all, and the registry those that were built in.
        Some(_) => TrackingError::NotBuiltIn { kind: "tracker", name: name.to_owned(), feature: "zoo" },
        None => unknown("tracker", name, trackers().iter().map(|e| e.name)),
    })
}

/// The detector called `name`.
///
/// # Errors
/// [`UnknownName`](TrackingError::UnknownName) with the names there are.
pub fn detector(name: &str) -> Result<&'static DetectorEntry> {
    let found = detectors().iter().find(|e| e.name == name);
    found.ok_or_else(|| unknown("detector", name, detectors().iter().map(|e| e.name)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tracker_of_the_survey_is_there_or_names_what_brings_it() {
        match tracker("struck") {
            Ok(entry) => assert!(cfg!(feature = "zoo") && entry.name == "struck"),
            Err(error) => {
                assert!(cfg!(not(feature = "zoo")) && error.to_string().contains("--features zoo"), "{error}")
            }
        }
        let error = tracker("strukc").err().map(|e| e.to_string()).unwrap_or_default();
        assert!(error.contains("there is no tracker called `strukc`") && error.contains("bacf"), "{error}");
    }
}
