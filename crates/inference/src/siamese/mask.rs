//! Masks that a network draws about a point of its answer: SiamMask (Wang et al. 2019, arXiv:1812.05050). Where a mask lies in the frame is the
//! arithmetic of PySOT (`pysot/tracker/siammask_tracker.py`, commit 2172c96) and of SiamMask's own `tools/test.py` (564c9bf).

use super::SiameseConfig;
use pursuit_geometry::{BBox, Mask, Point, Size};
use std::ops::Range;

/// What a network has drawn of the target: how likely each place of a window of the frame is the target's.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawnMask {
    /// Rows and columns.
    side: usize,
    /// Row by row, 0 to 1; 0 where the network answered no number.
    probabilities: Vec<f32>,
    /// What is above it is the target's.
    threshold: f64,
    /// Left, top, width and height in pixels of the frame.
    window: BBox,
}

/// Of a pixel: the place of the mask before or at it, and how near it is to the next.
type Tap = (i64, f64);

impl DrawnMask {
    /// From the logits about `point` (row, column) of the answer to a search image that was cut about `center` and covers `extent` (width,
    /// height) pixels of the frame. There must be `mask_side` squared of them.
    pub(super) fn new(
        logits: &[f32],
        config: &SiameseConfig,
        point: (usize, usize),
        center: Point,
        extent: (f64, f64),
    ) -> Self {
        let sigmoid = |v: &f32| if v.is_finite() { 1.0 / (1.0 + (-v).exp()) } else { 0.0 };
        // The windows of the template's size lie about the middle of the image as the points do.
        let from_middle = |k: usize| (k as f64 - (config.answer_side - 1) as f64 / 2.0) * config.stride_px;
        let side = config.search_side_px as f64;
        let (across, down) = (extent.0 / side, extent.1 / side);
        let middle = Point::new(center.x + from_middle(point.1) * across, center.y + from_middle(point.0) * down);
        let template = config.template_side_px as f64;
        Self {
            side: config.mask_side,
            probabilities: logits.iter().map(sigmoid).collect(),
            threshold: config.mask_threshold,
            window: BBox::from_center_size(middle, template * across, template * down),
        }
    }

    /// The target's pixels in a frame of `size`: where the probability, bilinear between the places and 0 beyond them, is above the threshold.
    pub fn in_frame(&self, size: Size) -> Mask {
        let mut mask = Mask::default();
        if !(self.window.is_finite() && self.window.area() > 0.0) {
            return mask;
        }
        let (left, top, width, height) = self.window.ltwh();
        let (columns, across) = self.taps(left, width, size.width);
        let (rows, down) = self.taps(top, height, size.height);
        for (y, &(row, share)) in rows.zip(&down) {
            let (upper, lower) = (self.row(row), self.row(row + 1));
            let along = |line: Option<&[f32]>, (column, share): Tap| {
                let at = |k: i64| usize::try_from(k).ok().and_then(|k| line?.get(k)).map_or(0.0, |&p| f64::from(p));
                at(column) * (1.0 - share) + at(column + 1) * share
            };
            let probability = |&tap: &Tap| along(upper, tap) * (1.0 - share) + along(lower, tap) * share;
            mask.extend_row(y, columns.start, across.iter().map(|tap| probability(tap) > self.threshold));
        }
        mask
    }

    fn row(&self, row: i64) -> Option<&[f32]> {
        self.probabilities.chunks_exact(self.side.max(1)).nth(usize::try_from(row).ok()?)
    }

    /// The pixels of a side of the frame that may be the target's, where the window covers `length` of them from `first` on, and where in the
    /// mask they lie. As in the released trackers (`_crop_back`), the first place lies on the pixel with which the window begins, and a frame of n
    /// pixels is taken to reach from its first to one beyond its last.
    fn taps(&self, first: f64, length: f64, pixels: usize) -> (Range<usize>, Vec<Tap>) {
        let grown = pixels as f64 / (pixels.max(2) - 1) as f64;
        let scale = self.side as f64 / length;
        let pixel = |place: f64| (first + place / scale) / grown;
        // Only between one place before the first and one behind the last.
        let (from, to) = (pixel(-1.0).floor().max(0.0), pixel(self.side as f64).ceil().min(pixels as f64));
        let range = from as usize..(to.max(from) as usize);
        let tap = |k: usize| {
            let place = (k as f64 * grown - first) * scale;
            (place.floor() as i64, place - place.floor())
        };
        (range.clone(), range.map(tap).collect())
    }
}
