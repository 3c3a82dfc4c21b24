//! Two stages by confidence (zhang2022, algorithm 1).

use super::{Given, Pairs};
use crate::TrackState;
use pursuit_estimation::EstimationError;
use pursuit_estimation::association::Assignment;

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

/// Which targets and which detections meet in a stage, and how far they must overlap.
struct Stage {
    least_overlap: f64,
    target: fn(confirmed: bool, state: TrackState) -> bool,
    sure: bool,
}

/// Assigns by overlap, stage by stage, what the stage before has left.
#[derive(Default)]
pub(super) struct TwoStage(Assignment);

impl TwoStage {
    pub fn associate(&mut self, pairs: &Pairs<'_>, given: &mut Given) -> Result<(), EstimationError> {
        let params = &pairs.params.two_stage;
        let stages = [
            Stage { least_overlap: params.sure_overlap, target: |confirmed, _| confirmed, sure: true },
            Stage {
                least_overlap: params.weak_overlap,
                target: |confirmed, state| confirmed && state == TrackState::Tracking,
                sure: false,
            },
            Stage { least_overlap: params.candidate_overlap, target: |confirmed, _| !confirmed, sure: true },
        ];
        stages.iter().try_for_each(|stage| self.assign(stage, pairs, given))
    }

    fn assign(&mut self, stage: &Stage, pairs: &Pairs<'_>, given: &mut Given) -> Result<(), EstimationError> {
        let takes_part = |t: usize| {
            let target = &pairs.targets[t];
            (stage.target)(target.confirmed, target.state) && given.shares[t].is_empty()
        };
        let meets = |d: usize| {
            let sure = pairs.detections[d].confidence >= pairs.params.two_stage.sure_from;
            sure == stage.sure && given.of_any[d] == 0.0
        };
        let cost = |t: usize, d: usize| {
            let overlap = if takes_part(t) && meets(d) && pairs.admitted(t, d) { pairs.overlap(t, d) } else { 0.0 };
            if overlap > 0.0 && overlap >= stage.least_overlap { 1.0 - overlap } else { f64::INFINITY }
        };
        let alone = 1.0 - stage.least_overlap;
        let assigned = self.0.solve(pairs.targets.len(), pairs.detections.len(), cost, |_| alone)?;
        for (target, detection) in assigned.iter().enumerate() {
            detection.iter().for_each(|d| given.give(target, *d));
        }
        Ok(())
    }
}
