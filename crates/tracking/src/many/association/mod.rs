//! Which detection is of which target: the model that [`AssociationParams`] name.
//!
//! All models read the same [`Distances`]: squared Mahalanobis distances from what each target is expected to measure, to which
//! another class adds, and which are infinite out of reach. A further model is a file of its own and its arms here.

mod expectation;
mod joint;
mod nearest;
mod two_stage;

pub(super) use expectation::Expectation;
pub use joint::JointAssociationParams;
pub use nearest::NearestParams;
pub use two_stage::TwoStageParams;

use crate::class::Classes;
use crate::{Detection, TrackState};
use joint::Joint;
use nalgebra::Vector4;
use nearest::Nearest;
use pursuit_estimation::association::Distances;
use pursuit_estimation::consistency::Gate;
use pursuit_estimation::{EstimationError, Gaussian};
use pursuit_geometry::Size;
use two_stage::TwoStage;

pursuit_parameters::choices! {
    /// How detections are given to targets.
    pub enum AssociationModel {
        /// Global nearest neighbour: as many pairs as the gate allows, of all ways the most likely one (Blackman and Popoli
        /// 1999, chapter 6).
        Nearest = "nearest",
        /// Sure detections first, then the weak ones that are left, by overlap (zhang2022).
        TwoStage = "two-stage",
        /// Every target is corrected by all detections near it, each for its probability (Fortmann, Bar-Shalom and Scheffe
        /// 1983).
        Joint = "joint",
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
        pub gate: f64 = 13.277, in above(0.0), source "99 % of χ² with 4 degrees of freedom";
        /// Farther from its prediction than this no target is found again, however long it was out of sight.
        pub reach: f64 = 4.0, in above(0.0), unit "sizes", source "ours";
        /// How often a detector that tells classes apart takes a thing for one of another class: a detection of a class other
        /// than the target's is farther by minus twice the logarithm of it.
        pub other_class: f64 = 0.05, in above(0.0).at_most(1.0), source "ours";
        /// Global nearest neighbour.
        pub nearest: NearestParams = NearestParams::default(), of [AssociationModel::Nearest];
        /// In two stages.
        pub two_stage as "two-stage": TwoStageParams = TwoStageParams::default(), of [AssociationModel::TwoStage];
        /// By probabilities.
        pub joint: JointAssociationParams = JointAssociationParams::default(), of [AssociationModel::Joint];
    }
}

impl AssociationParams {
    const fn gate(&self) -> Gate {
        Gate { threshold: self.gate }
    }
}

/// A target as association sees it.
pub(super) struct Claimant<'a> {
    pub expectation: &'a Expectation,
    /// Whether it is a target; else it is a candidate.
    pub confirmed: bool,
    /// Its state before this frame.
    pub state: TrackState,
    /// What its detections were taken for.
    pub classes: &'a Classes,
}

/// The detections that a target was given, each with the probability that it is the target's own.
pub(super) type Shares = Vec<(usize, f64)>;

/// Who was given what.
#[derive(Debug, Default)]
struct Given {
    shares: Vec<Shares>,
    /// Of each detection, how likely it is of one of the targets.
    of_any: Vec<f64>,
}

impl Given {
    fn clear(&mut self, targets: usize, detections: usize) {
        self.shares.resize_with(targets, Shares::new);
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
    distances: Distances,
    expected: Vec<Gaussian<4>>,
    seen: Vec<Vector4<f64>>,
    given: Given,
}

enum Model {
    Nearest(Nearest),
    TwoStage(TwoStage),
    Joint(Joint),
}

/// What a model decides by.
struct Pairs<'a> {
    params: &'a AssociationParams,
    distances: &'a Distances,
    targets: &'a [Claimant<'a>],
    detections: &'a [Detection],
    frame: Size,
}

impl Pairs<'_> {
    /// Overlap (IoU) of a detection with the target's prediction.
    fn overlap(&self, target: usize, detection: usize) -> f64 {
        self.targets[target].expectation.bbox().iou(&self.detections[detection].bbox)
    }

    /// Whether a pair is inside the gate.
    fn admitted(&self, target: usize, detection: usize) -> bool {
        self.distances.squared(target, detection) <= self.params.gate
    }
}

impl Association {
    /// The model that `params` name.
    ///
    /// # Errors
    /// Where a parameter is out of range.
    pub fn new(params: AssociationParams) -> Result<Self, EstimationError> {
        let model = match params.model {
            AssociationModel::Nearest => Model::Nearest(Nearest::new(&params)?),
            AssociationModel::TwoStage => Model::TwoStage(TwoStage::default()),
            AssociationModel::Joint => Model::Joint(Joint::new(&params)?),
        };
        let (expected, seen, given) = (Vec::new(), Vec::new(), Given::default());
        Ok(Self { params, model, distances: Distances::new(), expected, seen, given })
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
        if targets.is_empty() || detections.is_empty() {
            return Ok(());
        }
        self.measure(targets, detections)?;
        let Self { params, model, distances, given, .. } = self;
        let pairs = Pairs { params, distances, targets, detections, frame };
        match model {
            Model::Nearest(nearest) => nearest.associate(&pairs, given),
            Model::TwoStage(two_stage) => two_stage.associate(&pairs, given),
            Model::Joint(joint) => joint.associate(&pairs, given),
        }
    }

    /// What each target was given.
    pub fn shares(&self) -> &[Shares] {
        &self.given.shares
    }

    /// Of each detection, whether it is rather of none of the targets.
    pub fn left(&self) -> impl Iterator<Item = bool> + '_ {
        self.given.of_any.iter().map(|probability| *probability < 0.5)
    }

    fn measure(&mut self, targets: &[Claimant<'_>], detections: &[Detection]) -> Result<(), EstimationError> {
        self.expected.clear();
        self.expected.extend(targets.iter().map(|t| *t.expectation.measurement()));
        self.seen.clear();
        self.seen.extend(detections.iter().map(|d| expectation::measured(&d.bbox)));
        self.distances.fill(&self.expected, &self.seen)?;
        let mistaken = -2.0 * self.params.other_class.ln();
        for (t, target) in targets.iter().enumerate() {
            for (d, detection) in detections.iter().enumerate() {
                if !target.expectation.reaches(&detection.bbox, self.params.reach) {
                    self.distances.add(t, d, f64::INFINITY);
                } else if target.classes.is_other(detection.class.as_ref()) {
                    self.distances.add(t, d, mistaken);
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
