//! Widened boxes (yang2023: cascaded buffered intersection over union).

use super::near::{Pair, widened};
use super::stages::{Alike, Stages};
use super::{Given, Pairs};
use crate::Detection;
use pursuit_estimation::EstimationError;
use pursuit_geometry::BBox;

pursuit_parameters::parameters! {
    /// By the overlap of widened boxes: targets seen lately first, then all that are left by boxes widened more.
    pub struct BufferedParams {
        /// Share of its width and height by which each side of a box is moved outward, at first.
        pub small: f64 = 0.3, in 0.0.., source "yang2023, section 4.1";
        /// The same for what is left.
        pub large: f64 = 0.5, in 0.0.., source "yang2023, section 4.1";
        /// Least overlap (IoU) of widened boxes.
        pub overlap: f64 = 0.1, in 0.0..=1.0, source "ours";
        /// The same of weak detections.
        pub weak_overlap: f64 = 0.1, in 0.0..=1.0, source "ours";
        /// The same of candidates, which choose last.
        pub candidate_overlap: f64 = 0.1, in 0.0..=1.0, source "ours";
        /// Whether the second turn, by boxes widened more, is of weak detections instead of what the first has left.
        pub weak_by_large: bool = false, source "ours";
        /// Whether overlaps with sure detections are weighed by their confidence, before they are held against the least.
        pub weigh: bool = false, source "zhang2022, its program";
        /// Whether pairs of less overlap take part in the assignment, and are thrown out after it.
        pub late: bool = false, source "bewley2016, section 3.3";
        /// A detection is sure from this confidence; weak ones are given to targets seen in the frame before, and last.
        pub sure_from: f64 = 0.5, in 0.0..=1.0, source "ours";
    }
}

/// Overlap (IoU) of two boxes once each was widened.
fn overlap(a: &BBox, b: &BBox, buffer: f64) -> f64 {
    let wide = |bbox: &BBox| {
        let [left, top, right, bottom] = widened(bbox, buffer);
        BBox::from_ltrb(left, top, right, bottom)
    };
    wide(a).iou(&wide(b))
}

/// Assigns by widened boxes.
#[derive(Default)]
pub(super) struct Buffered(Stages);

impl Buffered {
    pub fn associate(&mut self, pairs: &Pairs<'_>, given: &mut Given) -> Result<(), EstimationError> {
        let params = &pairs.params.buffered;
        let sure = |pair: &Pair| pairs.detections[pair.detection].confidence >= params.sure_from;
        let confirmed = |pair: &Pair| pairs.targets[pair.target].confirmed;
        let seen = |pair: &Pair| pairs.targets[pair.target].unseen_s == 0.0;
        let alike = |pair: &Pair, buffer: f64, least: f64| {
            let predicted = pairs.targets[pair.target].expectation.bbox();
            let Detection { bbox, confidence, .. } = &pairs.detections[pair.detection];
            let weight = if params.weigh && sure(pair) { *confidence } else { 1.0 };
            Alike { likeness: overlap(predicted, bbox, buffer) * weight, least, late: params.late }
        };
        let BufferedParams { small, large, overlap: least, weak_overlap, candidate_overlap, .. } = *params;
        self.0.stage(pairs, given, |p| (sure(p) && confirmed(p)).then(|| alike(p, small, least)))?;
        let weak = if params.weak_by_large {
            large
        } else {
            self.0.stage(pairs, given, |p| (sure(p) && confirmed(p)).then(|| alike(p, large, least)))?;
            small
        };
        self.0.stage(pairs, given, |p| (!sure(p) && confirmed(p) && seen(p)).then(|| alike(p, weak, weak_overlap)))?;
        self.0.stage(pairs, given, |p| (sure(p) && !confirmed(p)).then(|| alike(p, small, candidate_overlap)))
    }
}
