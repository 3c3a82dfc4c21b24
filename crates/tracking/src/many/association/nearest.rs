//! Global nearest neighbour, at a price for no pair.

use super::near::Pair;
use super::{Claimant, Given, Pairs};
use crate::Detection;
use crate::many::cells::Cells;
use pursuit_estimation::EstimationError;
use pursuit_estimation::association::{Pairing, SparseAssignment};
use pursuit_geometry::Point;

pursuit_parameters::parameters! {
    /// Global nearest neighbour: a pair is taken where it is more likely than that the target was missed and the detection is of
    /// something else, a new target or nothing (Blackman and Popoli 1999, section 6.4).
    pub struct NearestParams {
        /// Chance that a target is detected, per frame.
        pub detected: f64 = 0.9, in above(0.0).below(1.0), source "ours";
        /// Density of detections that are of no target that is known, new ones and false ones: how many are to be expected in a
        /// square of the target's size, with a size up to e times larger or smaller than the target's.
        pub others: f64 = 0.3, in above(0.0), source "ours";
        /// Degrees of freedom of the errors of prediction and measurement together: a t distribution, whose tails are those of the
        /// turns of cameras and of boxes that leave the picture. Many: a Gaussian.
        pub freedom: f64 = 4.5, in above(0.0), source "ours";
        /// How much better a sure detection is than an unsure one: weight of the logarithm of its odds. 0: not at all.
        pub confidence_weight: f64 = 0.25, in 0.0.., source "ours";
        /// Weight of the likeness of embeddings (cosine) beyond `look_even`, of detections that have them.
        pub look_weight: f64 = 8.0, in 0.0.., unit "nats", source "ours";
        /// The likeness that speaks neither for a pair nor against it.
        pub look_even: f64 = 0.6, in -1.0..=1.0, source "ours";
        /// Weight of the overlap (IoU) with the prediction, in nats, beside the likelihood of the distance; 0: that alone.
        pub iou_weight: f64 = 2.0, in 0.0.., unit "nats", source "ours";
        /// What is left goes to a target that is alone, whatever the gates say, if that was seen in the last so many seconds: nobody else can be meant.
        pub alone_s: f64 = 0.3, in 0.0.., unit "s", source "ours";
        /// A target is alone where no other detection, and of the detection no other target, is nearer than this …
        pub alone_within: f64 = 4.0, in 0.0.., unit "sizes", source "ours";
        /// … and gets one that is no farther than this.
        pub alone_reach: f64 = 2.0, in 0.0.., unit "sizes", source "ours";
        /// A detection of another size, by more than this, is of none that is alone.
        pub alone_scale: f64 = 1.6, in 1.0.., source "ours";
    }
}

/// What a pair is worth: the logarithm of how much likelier it is than that the target was missed and the detection is of something else.
pub(super) struct Price<'a> {
    params: &'a NearestParams,
    /// `ln(P_D (2π)⁻² / ((1 − P_D) λ))`, the part that all pairs share.
    shared: f64,
}

impl<'a> Price<'a> {
    pub fn new(params: &'a NearestParams) -> Self {
        let shared =
            (params.detected / (1.0 - params.detected)).ln() - 2.0 * std::f64::consts::TAU.ln() - params.others.ln();
        Self { params, shared }
    }

    /// In nats.
    pub fn nats(&self, pair: &Pair, detections: &[Detection]) -> f64 {
        let params = self.params;
        // Another class is no matter of distance: its price is not softened by the tails.
        let far = 0.5 * (params.freedom + 4.0) * ((pair.squared - pair.mistaken) / params.freedom).ln_1p();
        let mut nats =
            self.shared - far - 0.5 * pair.mistaken - 0.5 * pair.log_determinant + params.iou_weight * pair.overlap;
        if params.confidence_weight > 0.0 {
            let confidence = detections[pair.detection].confidence.clamp(1e-3, 1.0 - 1e-3);
            nats += params.confidence_weight * (confidence / (1.0 - confidence)).ln();
        }
        if let Some(likeness) = pair.likeness {
            nats += params.look_weight * (likeness - params.look_even);
        }
        nats
    }
}

/// Of all ways to pair the most likely one.
#[derive(Default)]
pub(super) struct Nearest {
    pairings: Vec<Pairing>,
    assignment: SparseAssignment,
    alone: Alone,
}

impl Nearest {
    pub fn associate(&mut self, pairs: &Pairs<'_>, given: &mut Given) -> Result<(), EstimationError> {
        let price = Price::new(&pairs.params.nearest);
        self.pairings.clear();
        self.pairings.extend(pairs.near.iter().map(|pair| {
            let cost = -price.nats(pair, pairs.detections);
            Pairing { row: pair.target, column: pair.detection, cost }
        }));
        let assigned = self.assignment.solve(pairs.targets.len(), pairs.detections.len(), &self.pairings)?;
        for (target, detection) in assigned.iter().enumerate() {
            detection.iter().for_each(|d| given.give(target, *d));
        }
        self.alone.give(pairs, given);
        Ok(())
    }
}

/// Gives what is left to targets that are alone with it. Keeps its memory from one frame to the next.
#[derive(Default)]
pub(super) struct Alone {
    /// The targets that want something.
    wanting: Vec<usize>,
    /// Where targets are expected, in cells; filled where somebody asks.
    targets: Cells,
}

impl Alone {
    pub fn give(&mut self, pairs: &Pairs<'_>, given: &mut Given) {
        let params = &pairs.params.nearest;
        if params.alone_s <= 0.0 || params.alone_within <= 0.0 {
            return;
        }
        let wants = |(target, claimant): &(usize, &Claimant<'_>)| {
            given.shares[*target].is_empty() && claimant.confirmed && claimant.unseen_s <= params.alone_s
        };
        self.wanting.clear();
        self.wanting.extend(pairs.targets.iter().enumerate().filter(wants).map(|(target, _)| target));
        if self.wanting.is_empty() || given.of_any.iter().all(|taken| *taken > 0.0) {
            return;
        }
        let mut in_cells = false;
        for &target in &self.wanting {
            let claimant = &pairs.targets[target];
            let own = claimant.expectation.bbox();
            let size = own.area().sqrt();
            let within = params.alone_within * size;
            let here = own.center();
            let Some(detection) = only(pairs.cells, here, within, |d| pairs.detections[d].bbox.center()) else {
                continue;
            };
            let bbox = &pairs.detections[detection].bbox;
            let scale = (bbox.area() / own.area()).sqrt();
            let near = bbox.center().distance(here) <= params.alone_reach * size;
            let alike = near && scale <= params.alone_scale && scale * params.alone_scale >= 1.0;
            let taken = given.of_any[detection] > 0.0;
            if !alike || taken || claimant.classes.is_other(pairs.detections[detection].class.as_ref()) {
                continue;
            }
            if !std::mem::replace(&mut in_cells, true) {
                self.targets.fill(pairs.targets.iter().map(|t| t.expectation.bbox()));
            }
            let place = |t: usize| pairs.targets[t].expectation.bbox().center();
            if only(&self.targets, bbox.center(), within, place) == Some(target) {
                given.give(target, detection);
            }
        }
    }
}

/// The one thing within a distance of a place; `None` where there is none, or several.
fn only(cells: &Cells, here: Point, within: f64, place: impl Fn(usize) -> Point) -> Option<usize> {
    let range = [here.x - within, here.y - within, here.x + within, here.y + within];
    let (mut first, mut several) = (None, false);
    cells.near(&range, 0.0, |which| {
        if !several && place(which).distance(here) <= within {
            several = first.replace(which).is_some();
        }
    });
    first.filter(|_| !several)
}
