//! Whole things, of detectors that model the scene: a region that suddenly takes in a target is that target, larger; a target
//! that lies in another's region and is never seen apart is a part of it.

use super::association::Association;
use super::target::Target;
use crate::{Detection, TrackState};
use serde::{Deserialize, Serialize};

pursuit_parameters::parameters! {
    /// Of detectors that model the scene: what becomes of targets that are parts of something larger.
    pub struct WholeParams {
        /// A region that nobody else has and that takes in so much of a target is that target, grown; above 1: never.
        pub takes_in: f64 = 0.7, in 0.0..=2.0, source "ours";
        /// A target that is not seen itself, so much of which lies in what was seen of another, is a part of that one …
        pub inside: f64 = 0.7, in 0.0..=1.0, source "ours";
        /// … if it has less than this share of the other's area: somebody who is hidden has more.
        pub smaller: f64 = 0.5, in 0.0..=1.0, source "ours";
        /// For so long it is waited whether it is seen apart.
        pub wait_s: f64 = 0.3, in 0.0.., unit "s", source "ours";
    }
}

/// For how long a target has been a part of another, in seconds.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub(super) struct PartOf(pub f64);

/// Gives regions that are left over to targets that lie in them and were given nothing: of several the largest.
pub(super) fn grow(
    association: &mut Association,
    targets: &mut [Target],
    detections: &[Detection],
    params: &WholeParams,
) {
    for (d, detection) in detections.iter().enumerate() {
        if !association.is_left(d) {
            continue;
        }
        let lies_in = |t: &Target| {
            let followed = t.id().is_some() && t.known.belief.state != TrackState::Lost;
            let grows = t.bbox().area() < detection.bbox.area();
            followed && grows && t.bbox().fraction_inside(&detection.bbox) >= params.takes_in
        };
        let free = (0..targets.len()).filter(|t| association.has_nothing(*t) && targets.get(*t).is_some_and(lies_in));
        let area = |t: &usize| targets.get(*t).map_or(0.0, |t| t.bbox().area());
        let Some(largest) = free.max_by(|a, b| area(a).total_cmp(&area(b))) else { continue };
        association.give(largest, d);
        if let Some(target) = targets.get_mut(largest) {
            target.grown = true;
        }
    }
}

/// Counts for how long targets have been parts of others.
pub(super) fn count_parts(targets: &mut [Target], detections: &[Detection], params: &WholeParams) {
    for i in 0..targets.len() {
        let Some(target) = targets.get(i) else { return };
        let own = target.bbox();
        let is_part = target.id().is_some()
            && target.taken.is_none()
            && targets.iter().filter_map(|t| detections.get(t.taken?)).any(|other| {
                own.fraction_inside(&other.bbox) >= params.inside && own.area() < params.smaller * other.bbox.area()
            });
        if let Some(target) = targets.get_mut(i) {
            target.known.part_of.0 = if is_part { target.known.part_of.0 + target.dt_s } else { 0.0 };
        }
    }
}
