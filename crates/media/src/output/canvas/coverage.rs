//! How much of a pixel a shape covers, and which pixels can be covered at all.

use pursuit_geometry::{BBox, Point, Size};
use std::ops::Range;

/// The pixels of an image that a box touches.
pub(super) struct Clip {
    left: usize,
    top: usize,
    right: usize,
    bottom: usize,
}

impl Clip {
    /// `None` when there are none, or the box cannot be placed.
    pub(super) fn of(bbox: &BBox, size: Size) -> Option<Self> {
        let inside = bbox.clipped_to(size)?;
        let clip = Self {
            left: inside.left().floor() as usize,
            top: inside.top().floor() as usize,
            right: (inside.right().ceil() as usize).min(size.width),
            bottom: (inside.bottom().ceil() as usize).min(size.height),
        };
        (clip.left < clip.right && clip.top < clip.bottom).then_some(clip)
    }

    pub(super) fn rows(&self) -> Range<usize> {
        self.top..self.bottom
    }

    pub(super) fn columns(&self) -> Range<usize> {
        self.left..self.right
    }
}

/// The length that `[low, high)` has in common with pixel `at`.
pub(super) fn overlap(low: f64, high: f64, at: usize) -> f64 {
    (high.min(at as f64 + 1.0) - low.max(at as f64)).clamp(0.0, 1.0)
}

/// Distance of `p` from the line between `from` and `to`.
pub(super) fn distance(p: Point, from: Point, to: Point) -> f64 {
    let (dx, dy) = (to.x - from.x, to.y - from.y);
    let square = dx * dx + dy * dy;
    let along = if square > 0.0 { ((p.x - from.x) * dx + (p.y - from.y) * dy) / square } else { 0.0 };
    let along = along.clamp(0.0, 1.0);
    (p.x - from.x - along * dx).hypot(p.y - from.y - along * dy)
}

/// The columns of row `y` that can lie within `reach` of the line; a diagonal then costs its length, not its bounding box.
pub(super) fn columns_near(from: Point, to: Point, reach: f64, y: usize, clip: &Clip) -> Range<usize> {
    let (top, bottom) = (y as f64 - reach, y as f64 + 1.0 + reach);
    let height = to.y - from.y;
    let (low, high) = if height.abs() < 1e-9 {
        (from.x.min(to.x), from.x.max(to.x))
    } else {
        let at = |edge: f64| from.x + (to.x - from.x) * ((edge - from.y) / height).clamp(0.0, 1.0);
        (at(top).min(at(bottom)), at(top).max(at(bottom)))
    };
    let left = ((low - reach).max(0.0) as usize).clamp(clip.left, clip.right);
    let right = ((high + reach).max(0.0).ceil() as usize).clamp(left, clip.right);
    left..right
}

/// The part of the line inside `bbox` (Liang & Barsky 1984); `None` when there is none or an end cannot be placed.
pub(super) fn clipped(from: Point, to: Point, bbox: &BBox) -> Option<(Point, Point)> {
    // Beyond this, differences of coordinates lose fractions of a pixel.
    let placeable = |v: f64| v.abs() < 1e12;
    if ![from.x, from.y, to.x, to.y].into_iter().all(placeable) {
        return None;
    }
    let (dx, dy) = (to.x - from.x, to.y - from.y);
    let (mut begin, mut end) = (0.0f64, 1.0f64);
    let walls = [
        (-dx, from.x - bbox.left()),
        (dx, bbox.right() - from.x),
        (-dy, from.y - bbox.top()),
        (dy, bbox.bottom() - from.y),
    ];
    for (towards, room) in walls {
        if towards == 0.0 {
            if room < 0.0 {
                return None;
            }
        } else if towards < 0.0 {
            begin = begin.max(room / towards);
        } else {
            end = end.min(room / towards);
        }
    }
    let at = |t: f64| Point::new(from.x + t * dx, from.y + t * dy);
    (begin <= end).then(|| (at(begin), at(end)))
}
