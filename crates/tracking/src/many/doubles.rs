//! When two targets are one thing: the model that [`DoublesParams`] name.

use super::target::{Standing, Target};
use crate::TrackState;

pursuit_parameters::choices! {
    /// What is done about two targets that are one thing.
    pub enum DoublesModel {
        /// Nothing: both are kept.
        Keep = "keep",
        /// A target that is not seen where another is seen is that one; the older of the two ids goes on (zhang2022, its program).
        Overlap = "overlap",
    }
}

pursuit_parameters::parameters! {
    /// When two targets are one thing.
    pub struct DoublesParams {
        /// The model.
        pub model: DoublesModel = DoublesModel::Keep, source "ours";
        /// By overlap.
        pub overlap: OverlapParams = OverlapParams::default(), of [DoublesModel::Overlap];
    }
}

pursuit_parameters::parameters! {
    /// By the overlap of a target that is not seen with one that is.
    pub struct OverlapParams {
        /// They are one thing where their boxes overlap by more (IoU).
        pub above: f64 = 0.85, in 0.0..=1.0, source "zhang2022, its program";
        /// A target is taken for another only once it was not seen for so long.
        pub unseen_s: f64 = 0.0, in 0.0.., unit "s", source "ours";
    }
}

/// Gives up what is not seen where another is seen. Targets that a user pointed at stay what they are.
pub(super) fn merge(targets: &mut Vec<Target>, params: &DoublesParams) {
    let &OverlapParams { above, unseen_s } = match params.model {
        DoublesModel::Keep => return,
        DoublesModel::Overlap => &params.overlap,
    };
    let mut at = 0;
    while at < targets.len() {
        match twin(targets, at, above, unseen_s) {
            Some(seen) => {
                keep_older(targets, at, seen);
                targets.remove(at);
            }
            None => at += 1,
        }
    }
}

/// The target that the one `at` this place is, if that is not seen.
fn twin(targets: &[Target], at: usize, above: f64, unseen_s: f64) -> Option<usize> {
    let unseen = targets.get(at)?;
    let confirmed = |t: &Target| matches!(t.known.standing, Standing::Confirmed(_));
    if !confirmed(unseen) || unseen.is_seen() || unseen.unseen_s() < unseen_s {
        return None;
    }
    let own = unseen.bbox();
    let same = |t: &Target| confirmed(t) && t.is_seen() && t.known.belief.state == TrackState::Tracking;
    let overlaps = targets.iter().enumerate().filter(|(_, t)| same(t)).map(|(k, t)| (k, t.bbox().iou(&own)));
    overlaps.filter(|(_, overlap)| *overlap > above).max_by(|a, b| a.1.total_cmp(&b.1)).map(|(k, _)| k)
}

/// What is seen goes on under the smaller of the two ids.
fn keep_older(targets: &mut [Target], unseen: usize, seen: usize) {
    let (Some(gone), Some(kept)) = (targets[unseen].id(), targets[seen].id()) else { return };
    if gone < kept {
        targets[seen].known.standing = Standing::Confirmed(gone);
    }
}
