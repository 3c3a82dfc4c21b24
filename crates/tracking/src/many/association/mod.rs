//! Which detection is of which target: the model that [`AssociationParams`] name.
//!
//! All models read the same list of pairs inside the gates: overlap and squared Mahalanobis distance from what each target is
//! expected to measure, to which another class adds. A further model is a file of its own and its arms here.

mod buffered;
mod expectation;
mod hypotheses;
mod joint;
mod near;
mod nearest;
mod observation;
mod stages;
mod two_stage;

pub use buffered::BufferedParams;
pub(super) use expectation::Expectation;
pub(super) use hypotheses::GoesOn;
pub use hypotheses::HypothesesParams;
pub use joint::JointAssociationParams;
pub use nearest::NearestParams;
pub use observation::ObservationParams;
pub use two_stage::TwoStageParams;

use super::branches::Branches;
use super::cells::Cells;
use super::embedding::Undecided;
use super::look::Look;
use super::observed::Observed;
use crate::class::Classes;
use crate::{Detection, TrackState};
use buffered::Buffered;
use hypotheses::Hypotheses;
use joint::Joint;
use near::{Near, Pair};
use nearest::Nearest;
use observation::Observation;
use pursuit_estimation::EstimationError;
use pursuit_geometry::Size;
use two_stage::TwoStage;

pursuit_parameters::choices! {
    /// How detections are given to targets.
    pub enum AssociationModel {
        /// Global nearest neighbour: of all ways to pair detections with targets, or with none, the most likely one (Blackman and
        /// Popoli 1999, chapter 6).
        Nearest = "nearest",
        /// Sure detections first, then the weak ones that are left, by overlap (zhang2022).
        TwoStage = "two-stage",
        /// By the overlap of boxes that were widened, first a little and then more, so that fast targets at few frames a second
        /// overlap too (yang2023).
        Buffered = "buffered",
        /// By overlap and direction of what was observed, with a second look where a target was seen last (cao2023).
        Observation = "observation",
        /// Every target is corrected by all detections near it, each for its probability (Fortmann, Bar-Shalom and Scheffe
        /// 1983).
        Joint = "joint",
        /// As `nearest`, but what cannot be decided in one frame is decided some frames later: multiple hypothesis tracking (Kurien
        /// 1990; Blackman 2004).
        Hypotheses = "hypotheses",
    }
}

pursuit_parameters::parameters! {
    /// Which detection is of which target.
    pub struct AssociationParams {
        /// The model.
        pub model: AssociationModel = AssociationModel::Nearest, source "ours";
        /// Detections less likely than this are passed over.
        pub least_confidence: f64 = 0.1, in 0.0..=1.0, source "ours";
        /// Squared Mahalanobis distance of centre and size from the prediction beyond which a detection is not the target's.
        pub gate: f64 = 60.0, in above(0.0), source "ours";
        /// A detection is not the target's unless the two boxes overlap once each side of both was moved outward by this share of
        /// the box's width or height …
        pub buffer: f64 = 0.25, in 0.0.., source "yang2023, section 3.2";
        /// … and by this much more for every second for which the target was not seen …
        pub buffer_growth: f64 = 0.2, in 0.0.., unit "1/s", source "ours";
        /// … but for no more than so many seconds.
        pub buffer_longest_s: f64 = 1.0, in 0.0.., unit "s", source "ours";
        /// Farther from its prediction than this no target is found again, however long it was out of sight.
        pub reach: f64 = 4.0, in above(0.0), unit "sizes", source "ours";
        /// How often a detector that tells classes apart takes a thing for one of another class: a detection of a class other
        /// than the target's is farther by minus twice the logarithm of it.
        pub other_class: f64 = 0.05, in above(0.0).at_most(1.0), source "ours";
        /// Global nearest neighbour, and the price of a pair in `hypotheses`.
        pub nearest: NearestParams = NearestParams::default(), of [AssociationModel::Nearest, AssociationModel::Hypotheses];
        /// In two stages.
        pub two_stage as "two-stage": TwoStageParams = TwoStageParams::default(), of [AssociationModel::TwoStage];
        /// By widened boxes.
        pub buffered: BufferedParams = BufferedParams::default(), of [AssociationModel::Buffered];
        /// By observations.
        pub observation: ObservationParams = ObservationParams::default(), of [AssociationModel::Observation];
        /// By probabilities.
        pub joint: JointAssociationParams = JointAssociationParams::default(), of [AssociationModel::Joint];
        /// By hypotheses over several frames.
        pub hypotheses: HypothesesParams = HypothesesParams::default(), of [AssociationModel::Hypotheses];
    }
}

/// A target as association sees it.
#[derive(Clone, Copy)]
pub(super) struct Claimant<'a> {
    pub expectation: &'a Expectation,
    /// Whether it is a target; else it is a candidate.
    pub confirmed: bool,
    /// Its state before this frame.
    pub state: TrackState,
    /// For how long it was not seen before this frame, in seconds.
    pub unseen_s: f64,
    /// What its detections were taken for.
    pub classes: &'a Classes,
    /// What they look like.
    pub look: &'a Look,
    /// The boxes that it was given lately.
    pub observed: &'a Observed,
    /// What it might have been given instead.
    pub branches: &'a Branches,
}

/// The memory of a list of claimants, for those of the next frame.
pub(super) fn emptied(mut claimants: Vec<Claimant<'_>>) -> Vec<Claimant<'static>> {
    claimants.clear();
    // Of none another is made, in the same place: what they borrowed is no longer asked for.
    claimants.into_iter().map_while(|_| None).collect()
}

/// The detections that a target was given, each with the probability that it is the target's own.
pub(super) type Shares = Vec<(usize, f64)>;

/// Who was given what.
#[derive(Debug, Default)]
struct Given {
    targets: usize,
    /// Of each target; those behind the last one are kept for their memory.
    shares: Vec<Shares>,
    /// Of each detection, how likely it is of one of the targets.
    of_any: Vec<f64>,
}

impl Given {
    fn clear(&mut self, targets: usize, detections: usize) {
        self.targets = targets;
        self.shares.resize_with(targets.max(self.shares.len()), Shares::new);
        self.shares.iter_mut().for_each(Shares::clear);
        self.of_any.clear();
        self.of_any.resize(detections, 0.0);
    }

    /// The target's for certain.
    fn give(&mut self, target: usize, detection: usize) {
        self.shares[target].push((detection, 1.0));
        self.of_any[detection] = 1.0;
    }
}

/// Gives detections to targets. Keeps its memory from one frame to the next.
pub(super) struct Association {
    params: AssociationParams,
    model: Model,
    near: Near,
    given: Given,
    undecided: Undecided,
    /// Every branch of every target, of models that have them; none between two frames.
    branches: Vec<Claimant<'static>>,
}

enum Model {
    Nearest(Nearest),
    TwoStage(TwoStage),
    Buffered(Buffered),
    Observation(Observation),
    Joint(Box<Joint>),
    Hypotheses(Box<Hypotheses>),
}

/// What a model decides by.
struct Pairs<'a> {
    params: &'a AssociationParams,
    /// The pairs inside the gates, by targets and then by detections.
    near: &'a [Pair],
    /// The detections in cells.
    cells: &'a Cells,
    targets: &'a [Claimant<'a>],
    detections: &'a [Detection],
    frame: Size,
}

impl Association {
    /// The model that `params` name.
    ///
    /// # Errors
    /// Where a parameter is out of range.
    pub fn new(params: AssociationParams) -> Result<Self, EstimationError> {
        let model = match params.model {
            AssociationModel::Nearest => Model::Nearest(Nearest::default()),
            AssociationModel::TwoStage => Model::TwoStage(TwoStage::default()),
            AssociationModel::Buffered => Model::Buffered(Buffered::default()),
            AssociationModel::Observation => Model::Observation(Observation::default()),
            AssociationModel::Joint => Model::Joint(Box::default()),
            AssociationModel::Hypotheses => Model::Hypotheses(Box::default()),
        };
        let (near, given, undecided) = (Near::default(), Given::default(), Undecided::default());
        Ok(Self { params, model, near, given, undecided, branches: Vec::new() })
    }

    /// Gives `detections`, which were found in a picture of the size `frame`, to targets.
    ///
    /// # Errors
    /// Where a distance cannot be computed.
    pub fn associate(
        &mut self,
        targets: &[Claimant<'_>],
        detections: &[Detection],
        frame: Size,
    ) -> Result<(), EstimationError> {
        self.given.clear(targets.len(), detections.len());
        let Self { params, model, near, given, branches, .. } = self;
        // Branches go on without detections too, and are looked at each by itself.
        if let Model::Hypotheses(hypotheses) = model {
            let mut all: Vec<Claimant<'_>> = std::mem::take(branches);
            hypotheses.branches(targets, &mut all);
            near.find(params, &all, detections);
            *branches = emptied(all);
            let pairs = Pairs { params, near: near.pairs(), cells: near.cells(), targets, detections, frame };
            return hypotheses.associate(&pairs, given);
        }
        if targets.is_empty() || detections.is_empty() {
            return Ok(());
        }
        near.find(params, targets, detections);
        let pairs = Pairs { params, near: near.pairs(), cells: near.cells(), targets, detections, frame };
        match model {
            Model::Nearest(nearest) => nearest.associate(&pairs, given),
            Model::TwoStage(two_stage) => two_stage.associate(&pairs, given),
            Model::Buffered(buffered) => buffered.associate(&pairs, given),
            Model::Observation(observation) => observation.associate(&pairs, given),
            Model::Joint(joint) => joint.associate(&pairs, given),
            Model::Hypotheses(_) => Ok(()),
        }
    }

    /// Of each detection, whether its looks would decide whose it is; a target's are wanted anew after `every_s`.
    pub fn undecided(&mut self, targets: &[Claimant<'_>], detections: &[Detection], every_s: f64) -> &[bool] {
        self.near.find(&self.params, targets, detections);
        let pairs = self.near.pairs().iter().map(|pair| (pair.target, pair.detection));
        self.undecided.find(targets, detections.len(), pairs, every_s)
    }

    /// What each target was given.
    pub fn shares(&self) -> &[Shares] {
        let of = self.given.targets.min(self.given.shares.len());
        &self.given.shares[..of]
    }

    /// How the branches of a target go on, of models that have them.
    pub fn goes_on(&self, target: usize) -> Option<GoesOn<'_>> {
        match &self.model {
            Model::Hypotheses(hypotheses) => hypotheses.goes_on(target),
            Model::Nearest(_) | Model::TwoStage(_) | Model::Buffered(_) | Model::Observation(_) | Model::Joint(_) => {
                None
            }
        }
    }

    /// Whether a target was given nothing.
    pub fn has_nothing(&self, target: usize) -> bool {
        self.shares().get(target).is_some_and(Vec::is_empty)
    }

    /// Whether a detection is rather of none of the targets.
    pub fn is_left(&self, detection: usize) -> bool {
        self.given.of_any.get(detection).is_some_and(|probability| *probability < 0.5)
    }

    /// Gives a detection to a target for certain.
    pub fn give(&mut self, target: usize, detection: usize) {
        if target < self.given.targets && detection < self.given.of_any.len() {
            self.given.give(target, detection);
        }
    }

    /// Of each detection, whether it is rather of none of the targets.
    pub fn left(&self) -> impl Iterator<Item = bool> + '_ {
        self.given.of_any.iter().map(|probability| *probability < 0.5)
    }
}

#[cfg(test)]
mod tests;
