//! The tracker `median-flow`: a box followed by its points from frame to frame (kalal2010), with its detection of failure,
//! in the one loop. See `docs/papers/tld.md`.

use super::{FlowParams, Follower};
use crate::appearance::PatchSampler;
use pursuit_estimation::sigmoid;
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_parameters::Parameters;
use pursuit_tracking::motion::MotionParams;
use pursuit_tracking::policy::PolicyParams;
use pursuit_tracking::search::{SearchModel, SearchParams};
use pursuit_tracking::{
    Figure, Figures, GroupParams, Localizer, LocalizerRecipe, Measurement, Outcome, Result, Search, TrackerRecipe,
};
use serde::{Deserialize, Serialize};

/// Pixels across, and down, the patches by which a box is compared with that of the start.
const SIDE: usize = 15;

pursuit_parameters::parameters! {
    /// Parameters of the tracker of points.
    pub struct MedianFlowTrackerParams {
        /// How the box is followed.
        pub flow: FlowParams = FlowParams::default();
        /// Score: constant of the logistic regression.
        pub score_bias: f64 = -4.0, in Bounds::default(), source "ours, fitted";
        /// Score: weight of the median correlation of the points' patches.
        pub score_correlation: f64 = 4.0, in Bounds::default(), source "ours, fitted";
        /// Score: weight of the correlation of the box with that of the start.
        pub score_likeness: f64 = 3.0, in Bounds::default(), source "ours, fitted";
    }
}

pursuit_tracking::figures! {
    /// What the points of a box say.
    struct FlowFigures {
        /// Median correlation of the points' patches.
        correlation;
        /// Correlation of the box with that of the start.
        likeness;
        /// Median forward-backward error of the points.
        forward_backward_px in "px";
        /// Median distance of the points from where the box's motion takes them.
        residual_px in "px";
        /// Points that agree.
        points;
    }
}

/// Follows the points of a box. It knows how the box looked at the start, for its score alone.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(remote = "MedianFlowLocalizer")]
pub struct MedianFlowLocalizer {
    params: MedianFlowTrackerParams,
    follower: Follower,
    first: Vec<f32>,
    #[serde(skip)]
    sampler: PatchSampler,
    #[serde(skip)]
    patch: Vec<f32>,
}

pursuit_estimation::checked!(MedianFlowLocalizer);

impl MedianFlowLocalizer {
    fn restored(self) -> Result<Self, String> {
        self.params.check_all().map_err(|(name, problem)| format!("`{name}` {problem}"))?;
        if self.first.len() != SIDE * SIDE || self.first.iter().any(|v| !v.is_finite()) {
            return Err("its first patch has another size".to_owned());
        }
        Ok(self)
    }
}

impl LocalizerRecipe for MedianFlowTrackerParams {
    type Localizer = MedianFlowLocalizer;

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<MedianFlowLocalizer> {
        let follower = Follower::new(self.flow.clone(), frame, bbox)?;
        let (mut sampler, mut first) = (PatchSampler::default(), Vec::new());
        sampler.normalized(frame.gray(), &bbox, SIDE, &mut first);
        Ok(MedianFlowLocalizer { params: self.clone(), follower, first, sampler, patch: Vec::new() })
    }
}

impl Localizer for MedianFlowLocalizer {
    type Finding = ();

    const FIGURES: &[&[Figure]] = &[FlowFigures::ALL];

    fn locate(&mut self, frame: &Frame, search: &Search) -> Result<Option<(Measurement, ())>> {
        let Some(motion) = self.follower.follow(frame, &search.expected)? else { return Ok(None) };
        self.sampler.normalized(frame.gray(), &motion.bbox, SIDE, &mut self.patch);
        let likeness = f64::from(pursuit_vision::patch::dot(&self.patch, &self.first));
        let p = &self.params;
        let log_odds = p.score_bias + p.score_correlation * motion.correlation + p.score_likeness * likeness;
        let measurement = Measurement {
            diagnostics: FlowFigures {
                correlation: motion.correlation,
                likeness,
                forward_backward_px: motion.forward_backward_px,
                residual_px: motion.residual_px,
                points: motion.kept as f64,
            }
            .into(),
            ..Measurement::new(motion.bbox, sigmoid(log_odds))
        };
        Ok(Some((measurement, ())))
    }

    fn adapt(&mut self, _: &Frame, _: BBox, (): &()) -> Result<()> {
        Ok(())
    }

    fn observe(&mut self, frame: &Frame, outcome: &Outcome<'_, ()>) -> Result<()> {
        let followed = outcome.found.filter(|_| outcome.followed.is_some());
        followed.map_or(Ok(()), |(measured, ())| self.follower.keep(frame, measured))
    }

    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        *self = self.params.localizer(frame, bbox)?;
        Ok(())
    }
}

/// `median-flow`. Where its points disagree it has failed: it looks for them again at the same place only.
pub fn median_flow(name: &'static str) -> TrackerRecipe<MedianFlowTrackerParams> {
    let groups = GroupParams {
        motion: MotionParams::calm(),
        policy: PolicyParams { lost_after_s: 2.0, ..PolicyParams::default() },
        search: SearchParams { model: SearchModel::Near, ..SearchParams::default() },
    };
    TrackerRecipe { name, localizer: MedianFlowTrackerParams::default(), groups }
}
