//! The pairs of targets and detections that are near enough: looked for in order of place, and measured only where they are.

use super::{AssociationParams, Claimant, expectation};
use crate::Detection;
use pursuit_estimation::EstimationError;
use pursuit_geometry::BBox;

/// A target and a detection inside the gates.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pair {
    pub target: usize,
    pub detection: usize,
    /// Overlap (IoU) of the detection with the target's prediction.
    pub overlap: f64,
    /// Squared Mahalanobis distance from the prediction; another class adds to it.
    pub squared: f64,
    /// What another class has added to it; 0 where there is none.
    pub mistaken: f64,
    /// `ln det S` of what the target is expected to measure, with lengths in sizes of the target.
    pub log_determinant: f64,
    /// Cosine between the embeddings of target and detection, where both have one.
    pub likeness: Option<f64>,
}

/// Keeps its memory from one frame to the next.
#[derive(Debug, Default)]
pub(super) struct Near {
    /// Left side of each detection, and which it is, from left to right.
    order: Vec<(f64, usize)>,
    /// The widest detection.
    widest: f64,
    pairs: Vec<Pair>,
}

impl Near {
    /// Finds the pairs of a frame.
    ///
    /// # Errors
    /// Where a covariance is singular.
    pub fn find(
        &mut self,
        params: &AssociationParams,
        targets: &[Claimant<'_>],
        detections: &[Detection],
    ) -> Result<(), EstimationError> {
        self.pairs.clear();
        self.order.clear();
        self.order.extend(detections.iter().enumerate().map(|(at, d)| (d.bbox.left(), at)));
        self.order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        self.widest = detections.iter().map(|d| d.bbox.width()).fold(0.0, f64::max);
        let mistaken = -2.0 * params.other_class.ln();
        for (target, claimant) in targets.iter().enumerate() {
            let first = self.pairs.len();
            self.of(target, claimant, params, detections, mistaken)?;
            self.pairs[first..].sort_unstable_by_key(|pair| pair.detection);
        }
        Ok(())
    }

    fn of(
        &mut self,
        target: usize,
        claimant: &Claimant<'_>,
        params: &AssociationParams,
        detections: &[Detection],
        mistaken: f64,
    ) -> Result<(), EstimationError> {
        let expectation = claimant.expectation;
        let buffer = params.buffer + params.buffer_growth * claimant.unseen_s.min(params.buffer_longest_s);
        let own = widened(expectation.bbox(), buffer);
        // What was widened overlaps this range, and so starts not farther left than its own width from it.
        let from = own[0] - self.widest * (1.0 + buffer);
        let until = own[2] + self.widest * buffer;
        let start = self.order.partition_point(|(left, _)| *left < from);
        let mut spread = None;
        for (_, at) in self.order[start..].iter().take_while(|(left, _)| *left <= until) {
            let detection = &detections[*at];
            let other = widened(&detection.bbox, buffer);
            let apart = other[0] >= own[2] || own[0] >= other[2] || other[1] >= own[3] || own[1] >= other[3];
            if apart || !expectation.reaches(&detection.bbox, params.reach) {
                continue;
            }
            let spread = match &spread {
                Some(known) => known,
                None => spread.insert(expectation.spread()?),
            };
            let distance2 =
                spread.squared(&(expectation::measured(&detection.bbox) - expectation.measurement().mean()));
            let mistaken = if claimant.classes.is_other(detection.class.as_ref()) { mistaken } else { 0.0 };
            let squared = distance2 + mistaken;
            if squared <= params.gate {
                let overlap = expectation.bbox().iou(&detection.bbox);
                let log_determinant = spread.log_determinant;
                let likeness = detection.embedding.as_ref().and_then(|e| claimant.look.likeness(e));
                self.pairs.push(Pair { target, detection: *at, overlap, squared, mistaken, log_determinant, likeness });
            }
        }
        Ok(())
    }

    /// The pairs found, by targets and then by detections.
    pub fn pairs(&self) -> &[Pair] {
        &self.pairs
    }
}

/// Left, top, right and bottom once each side was moved outward by the share `buffer` of width or height.
pub(super) fn widened(bbox: &BBox, buffer: f64) -> [f64; 4] {
    let (left, top, width, height) = bbox.ltwh();
    let (dx, dy) = (buffer * width, buffer * height);
    [left - dx, top - dy, left + width + dx, top + height + dy]
}
