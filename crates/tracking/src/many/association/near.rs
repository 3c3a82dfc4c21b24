//! The pairs of targets and detections that are near enough: looked for in the cells around, and measured only where they are.

use super::{AssociationParams, Claimant};
use crate::Detection;
use crate::many::cells::Cells;
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
    cells: Cells,
    /// The detections whose cells are near that of a target.
    around: Vec<usize>,
    pairs: Vec<Pair>,
}

impl Near {
    /// Finds the pairs of a frame.
    pub fn find(&mut self, params: &AssociationParams, targets: &[Claimant<'_>], detections: &[Detection]) {
        self.pairs.clear();
        self.cells.fill(detections.iter().map(|d| &d.bbox));
        let mistaken = -2.0 * params.other_class.ln();
        for (target, claimant) in targets.iter().enumerate() {
            self.of(target, claimant, params, detections, mistaken);
        }
    }

    fn of(
        &mut self,
        target: usize,
        claimant: &Claimant<'_>,
        params: &AssociationParams,
        detections: &[Detection],
        mistaken: f64,
    ) {
        let expectation = claimant.expectation;
        let buffer = params.buffer + params.buffer_growth * claimant.unseen_s.min(params.buffer_longest_s);
        let own = widened(expectation.bbox(), buffer);
        let Self { cells, around, pairs } = self;
        around.clear();
        cells.near(&own, buffer, |at| {
            let other = widened(&detections[at].bbox, buffer);
            let apart = other[0] >= own[2] || own[0] >= other[2] || other[1] >= own[3] || own[1] >= other[3];
            if !apart && expectation.reaches(&detections[at].bbox, params.reach) {
                around.push(at);
            }
        });
        if around.is_empty() {
            return;
        }
        around.sort_unstable();
        let log_determinant = expectation.log_determinant();
        for &at in around.iter() {
            let detection = &detections[at];
            let distance2 = expectation.distance2(&detection.bbox);
            let mistaken = if claimant.classes.is_other(detection.class.as_ref()) { mistaken } else { 0.0 };
            let squared = distance2 + mistaken;
            if squared <= params.gate {
                let overlap = expectation.bbox().iou(&detection.bbox);
                let likeness = detection.embedding.as_ref().and_then(|e| claimant.look.likeness(e));
                pairs.push(Pair { target, detection: at, overlap, squared, mistaken, log_determinant, likeness });
            }
        }
    }

    /// The detections in cells.
    pub fn cells(&self) -> &Cells {
        &self.cells
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
