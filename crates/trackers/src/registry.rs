//! Every tracker and detector by name: the one list that the command line, the conformance suite, the benches and the
//! documentation read. Adding a tracker is one line in [`trackers`].

use crate::ball::BallDetectorParams;
use crate::detectors::motion::{self, MotionDetectorParams};
use crate::detectors::objects::{self, ObjectsParams};
use pursuit_tracking::registry::unknown;
use pursuit_tracking::{DetectorEntry, Result, TrackerEntry};

/// The tracker used where none is named.
pub const DEFAULT_TRACKER: &str = "pursuit";

/// An entry whose recipe is made by a function of the name.
macro_rules! tracker {
    ($name:literal, $paper:literal, $recipe:path, $summary:literal) => {
        TrackerEntry::new($name, $summary, $paper, |name| Box::new($recipe(name)))
    };
}

/// Every tracker.
pub const fn trackers() -> &'static [TrackerEntry] {
    const TRACKERS: &[TrackerEntry] = &[
        tracker!(
            "pursuit",
            "pursuit",
            crate::pursuit::pursuit,
            "the default: a filter and a network watch, one judge decides; says when the target is hidden, finds it again"
        ),
        tracker!(
            "pursuit-light",
            "pursuit",
            crate::pursuit::light,
            "the default's filter alone: quicker, says when the target is hidden, finds it again"
        ),
        tracker!(
            "nanotrack",
            "nanotrack",
            crate::nanotrack::nanotrack,
            "a small Siamese network, nothing to install: robust to changes of shape, slower than filters"
        ),
        tracker!(
            "fear-xs",
            "siamese",
            crate::siamese::fear_xs,
            "FEAR-XS, a Siamese network by file: more robust than nanotrack, and slower"
        ),
        tracker!(
            "siamese",
            "siamese",
            crate::siamese::siamese,
            "any Siamese network of yours: ONNX files and a TOML file that describes them"
        ),
        tracker!(
            "ball",
            "ball",
            crate::ball::ball,
            "a ball (or anything of one colour) by colour and shape, with a filter for bounces"
        ),
        tracker!(
            "depth-occlusion",
            "zhai2024",
            crate::depth_occlusion::depth_occlusion,
            "correlation on depth: knows when something nearer hides the target, waits, finds it again, in any light"
        ),
        tracker!(
            "depth-occlusion-fused",
            "zhai2024",
            crate::depth_occlusion::depth_occlusion_fused,
            "depth-occlusion on the gradients of depth and of the picture together"
        ),
        tracker!(
            "person",
            "qu2010",
            crate::person::person,
            "someone before a camera that stands still: the default's eye, the background's outline, the next position predicted"
        ),
        tracker!(
            "bacf",
            "bacf",
            crate::regularised::bacf,
            "background-aware correlation filter on gradients and colour names: accurate, quick"
        ),
        tracker!(
            "strcf",
            "strcf",
            crate::regularised::strcf,
            "spatial-temporal regularised correlation filter: learns each frame anew, near the last"
        ),
        tracker!(
            "kcf",
            "kcf",
            crate::kcf::kcf,
            "kernelized correlation filter on HOG with a search over sizes: very fast"
        ),
        tracker!(
            "kcf-fixed",
            "kcf",
            crate::kcf::kcf_fixed,
            "kernelized correlation filter on HOG as published: keeps the size, faster still"
        ),
        tracker!(
            "kcf-depth",
            "kcf",
            crate::kcf::kcf_depth,
            "kernelized correlation filter on HOG of depth (of grey where there is none): keeps the size"
        ),
        tracker!(
            "acpf",
            "zhai2024",
            crate::acpf::acpf,
            "occlusion-aware particle filter on colour and depth: the baseline that depth-occlusion is compared with"
        ),
        tracker!(
            "csk",
            "kcf",
            crate::kcf::csk,
            "kernelized correlation filter on grey values: the circulant structure tracker"
        ),
        tracker!(
            "mosse",
            "mosse",
            crate::mosse::mosse,
            "minimum output sum of squared error on grey values: the fastest, keeps the size"
        ),
        tracker!(
            "staple",
            "staple",
            crate::staple::staple,
            "HOG correlation beside colour histograms: bears deformation, fast"
        ),
        tracker!(
            "dsst",
            "dsst",
            crate::dsst::dsst,
            "correlation on gradients beside a filter along scale: exact sizes, quick"
        ),
        tracker!(
            "fdsst",
            "dsst",
            crate::dsst::fdsst,
            "dsst on compressed features with half as many sizes, interpolated: quicker"
        ),
        tracker!(
            "kalman-tld",
            "zhu2014",
            crate::tld::kalman_tld,
            "follows points, learns what the target is, finds it again; a Kalman filter says where to scan"
        ),
        tracker!(
            "tld",
            "tld",
            crate::tld::tld,
            "tracking-learning-detection: as kalman-tld, all over the frame at every frame, without the filter"
        ),
        tracker!(
            "median-flow",
            "tld",
            crate::flow::median_flow,
            "follows points there and back: exact on smooth motion, very fast, never finds a target again"
        ),
    ];
    TRACKERS
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
        DetectorEntry::of::<ObjectsParams>(
            "objects",
            "people, cars, animals … by a network of yours (an ONNX file, YOLOX or described beside it), under any camera",
            "pursuit",
            objects::detected_motion,
        ),
    ];
    DETECTORS
}

/// The tracker called `name`.
///
/// # Errors
/// [`UnknownName`](pursuit_tracking::TrackingError::UnknownName) with the names there are.
pub fn tracker(name: &str) -> Result<&'static TrackerEntry> {
    let found = trackers().iter().find(|e| e.name == name);
    found.ok_or_else(|| unknown("tracker", name, trackers().iter().map(|e| e.name)))
}

/// The detector called `name`.
///
/// # Errors
/// [`UnknownName`](pursuit_tracking::TrackingError::UnknownName) with the names there are.
pub fn detector(name: &str) -> Result<&'static DetectorEntry> {
    let found = detectors().iter().find(|e| e.name == name);
    found.ok_or_else(|| unknown("detector", name, detectors().iter().map(|e| e.name)))
}
