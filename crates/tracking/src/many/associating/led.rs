//! Targets whose trackers know better where they are than the detector does.

use super::super::target::Target;

/// So long after a target was found what a detector finds puts its box right all the same, seconds: who comes in is seen in part at first.
const COMES_IN_S: f64 = 2.0;

/// Whether there is a target whose tracker goes on by itself where the detector measures badly. Nothing that is found counts then: what
/// stands out beside such a target is more often background that lies wrong than somebody new.
pub(super) fn goes_on(targets: &[Target]) -> bool {
    targets.iter().any(|target| target.looked_at_s > COMES_IN_S)
}
