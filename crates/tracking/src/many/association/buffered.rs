//! Widened boxes (yang2023: cascaded buffered intersection over union).

use super::near::{Pair, widened};
use super::stages::Stages;
use super::{Given, Pairs};
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
        let alike = |pair: &Pair, buffer: f64| {
            let predicted = pairs.targets[pair.target].expectation.bbox();
            let overlap = overlap(predicted, &pairs.detections[pair.detection].bbox, buffer);
            (overlap >= params.overlap).then_some(overlap)
        };
        self.0.stage(pairs, given, |p| if sure(p) && confirmed(p) { alike(p, params.small) } else { None })?;
        self.0.stage(pairs, given, |p| if sure(p) && confirmed(p) { alike(p, params.large) } else { None })?;
        self.0.stage(
            pairs,
            given,
            |p| if !sure(p) && confirmed(p) && seen(p) { alike(p, params.small) } else { None },
        )?;
        self.0.stage(pairs, given, |p| if sure(p) && !confirmed(p) { alike(p, params.small) } else { None })
    }
}
