//! Places that were taken for a lost target and turned out to show something else.

use pursuit_geometry::BBox;
use serde::{Deserialize, Serialize};

/// Most places at once: the oldest goes.
const MOST: usize = 8;
/// A box that overlaps a place by this much (IoU) is there.
const SAME_FROM: f64 = 0.3;

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Place {
    bbox: BBox,
    /// Seconds for which it is refused still.
    left_s: f64,
}

/// Places that are refused for a while.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Refused(Vec<Place>);

impl Default for Refused {
    fn default() -> Self {
        Self(Vec::with_capacity(MOST))
    }
}

impl Refused {
    /// Refuses the place of `bbox` for `seconds`.
    pub fn add(&mut self, bbox: &BBox, seconds: f64) {
        self.0.retain(|place| place.bbox.iou(bbox) < SAME_FROM);
        if self.0.len() >= MOST {
            self.0.remove(0);
        }
        self.0.push(Place { bbox: *bbox, left_s: seconds });
    }

    /// Whether `bbox` lies at one of them.
    pub fn contains(&self, bbox: &BBox) -> bool {
        self.0.iter().any(|place| place.bbox.iou(bbox) >= SAME_FROM)
    }

    /// Lets `dt_s` seconds pass.
    pub fn age(&mut self, dt_s: f64) {
        self.0.iter_mut().for_each(|place| place.left_s -= dt_s);
        self.0.retain(|place| place.left_s > 0.0);
    }

    /// Moves all of them with the picture, by `(dx, dy)` pixels.
    pub fn carry(&mut self, (dx, dy): (f64, f64)) {
        self.0.iter_mut().for_each(|place| place.bbox = place.bbox.translated(dx, dy));
    }
}
