//! Two stages by confidence (zhang2022, algorithm 1).

use super::near::Pair;
use super::stages::{Alike, Stages};
use super::{Given, Pairs};
use crate::TrackState;
use pursuit_estimation::EstimationError;

pursuit_parameters::parameters! {
    /// Two stages by confidence: targets are given sure detections, then those still tracked weak ones; sure detections that are
    /// left go to candidates.
    pub struct TwoStageParams {
        /// A detection is sure from this confidence.
        pub sure_from: f64 = 0.6, in 0.0..=1.0, source "zhang2022, section 4.1";
        /// Least overlap (IoU) of a sure detection with a target's prediction.
        pub sure_overlap: f64 = 0.2, in 0.0..=1.0, source "zhang2022, section 4.1";
        /// Least overlap (IoU) of a weak detection with a target's prediction.
        pub weak_overlap: f64 = 0.5, in 0.0..=1.0, source "zhang2022, its program";
        /// Least overlap (IoU) of a sure detection with a candidate's prediction.
        pub candidate_overlap: f64 = 0.3, in 0.0..=1.0, source "zhang2022, its program";
        /// Whether overlaps with sure detections are weighed by their confidence, before they are held against the least.
        pub weigh: bool = false, source "zhang2022, its program";
        /// Whether candidates wait until targets have chosen; else they take part as targets do.
        pub candidates_last: bool = true, source "zhang2022, its program";
        /// Whether targets that are not tracked get weak detections too.
        pub weak_to_lost: bool = false, source "zhang2022, section 3";
        /// Whether pairs of less overlap take part in the assignment, and are thrown out after it.
        pub late: bool = false, source "bewley2016, section 3.3";
    }
}

/// Assigns by overlap, stage by stage, what the stage before has left.
#[derive(Default)]
pub(super) struct TwoStage(Stages);

impl TwoStage {
    pub fn associate(&mut self, pairs: &Pairs<'_>, given: &mut Given) -> Result<(), EstimationError> {
        let params = &pairs.params.two_stage;
        let sure = |pair: &Pair| pairs.detections[pair.detection].confidence >= params.sure_from;
        let early = |pair: &Pair| !params.candidates_last || pairs.targets[pair.target].confirmed;
        let seen = |pair: &Pair| params.weak_to_lost || pairs.targets[pair.target].state == TrackState::Tracking;
        let plain = |pair: &Pair, least: f64| Alike { likeness: pair.overlap, least, late: params.late };
        let weighed = |pair: &Pair, least: f64| {
            let weight = if params.weigh { pairs.detections[pair.detection].confidence } else { 1.0 };
            Alike { likeness: pair.overlap * weight, least, late: params.late }
        };
        let (first, weak, new) = (params.sure_overlap, params.weak_overlap, params.candidate_overlap);
        self.0.stage(pairs, given, |p| (sure(p) && early(p)).then(|| weighed(p, first)))?;
        self.0.stage(pairs, given, |p| (!sure(p) && early(p) && seen(p)).then(|| plain(p, weak)))?;
        self.0.stage(pairs, given, |p| (sure(p) && !early(p)).then(|| weighed(p, new)))
    }
}
