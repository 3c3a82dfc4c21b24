//! Two stages by confidence (zhang2022, algorithm 1).

use super::near::Pair;
use super::stages::Stages;
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
    }
}

/// Assigns by overlap, stage by stage, what the stage before has left.
#[derive(Default)]
pub(super) struct TwoStage(Stages);

impl TwoStage {
    pub fn associate(&mut self, pairs: &Pairs<'_>, given: &mut Given) -> Result<(), EstimationError> {
        let params = &pairs.params.two_stage;
        let sure = |pair: &Pair| pairs.detections[pair.detection].confidence >= params.sure_from;
        let confirmed = |pair: &Pair| pairs.targets[pair.target].confirmed;
        let seen = |pair: &Pair| pairs.targets[pair.target].state == TrackState::Tracking;
        let alike = |pair: &Pair, least: f64| (pair.overlap >= least && pair.overlap > 0.0).then_some(pair.overlap);
        let (first, weak, new) = (params.sure_overlap, params.weak_overlap, params.candidate_overlap);
        self.0.stage(pairs, given, |p| if sure(p) && confirmed(p) { alike(p, first) } else { None })?;
        self.0.stage(pairs, given, |p| if !sure(p) && confirmed(p) && seen(p) { alike(p, weak) } else { None })?;
        self.0.stage(pairs, given, |p| if sure(p) && !confirmed(p) { alike(p, new) } else { None })
    }
}
