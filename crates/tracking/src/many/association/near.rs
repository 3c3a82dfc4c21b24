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
    /// Left, top, width and height of the detections, one after the other: every target looks at those around it.
    boxes: Vec<[f64; 4]>,
    /// The detections that overlap a target's widened box once they are widened themselves: the first of so many places.
    around: Vec<usize>,
    pairs: Vec<Pair>,
}

impl Near {
    /// Finds the pairs of a frame.
    pub fn find(&mut self, params: &AssociationParams, targets: &[Claimant<'_>], detections: &[Detection]) {
        self.pairs.clear();
        self.cells.fill(detections.iter().map(|d| &d.bbox));
        self.boxes.clear();
        self.boxes.extend(detections.iter().map(|d| <[f64; 4]>::from(d.bbox.ltwh())));
        self.around.resize(detections.len(), 0);
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
        let Self { cells, boxes, around, pairs } = self;
        let mut count = 0;
        cells.near(&own, buffer, |at| {
            let [left, top, right, bottom] = outward(boxes[at], buffer);
            // Without a branch, which nobody could foresee: the place of one that is apart is written over by the next.
            let overlap = (left < own[2]) & (own[0] < right) & (top < own[3]) & (own[1] < bottom);
            around[count] = at;
            count += usize::from(overlap);
        });
        let around = &mut around[..count];
        around.sort_unstable();
        let mut log_determinant = None;
        for &at in around.iter() {
            let detection = &detections[at];
            if !expectation.reaches(&detection.bbox, params.reach) {
                continue;
            }
            let mistaken = if claimant.classes.is_other(detection.class.as_ref()) { mistaken } else { 0.0 };
            let squared = expectation.distance2(&detection.bbox) + mistaken;
            if squared <= params.gate {
                let overlap = expectation.bbox().iou(&detection.bbox);
                let likeness = detection.embedding.as_ref().and_then(|e| claimant.look.likeness(e));
                let log_determinant = *log_determinant.get_or_insert_with(|| expectation.log_determinant());
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
    outward(bbox.ltwh().into(), buffer)
}

/// The same of left, top, width and height.
#[inline]
fn outward([left, top, width, height]: [f64; 4], buffer: f64) -> [f64; 4] {
    let (dx, dy) = (buffer * width, buffer * height);
    [left - dx, top - dy, left + width + dx, top + height + dy]
}
