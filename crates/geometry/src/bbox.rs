use crate::{Point, Size};
use serde::{Deserialize, Serialize};

/// An axis-aligned box in continuous pixels.
///
/// Built only by [`from_ltwh`](Self::from_ltwh), [`from_ltrb`](Self::from_ltrb) and
/// [`from_center_size`](Self::from_center_size), so that the convention is written at every place a box is made.
/// Width and height are never negative. Coordinates may be non-finite if the caller's were; places that take a box from
/// outside check [`is_finite`](Self::is_finite) and [`is_empty`](Self::is_empty).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BBox {
    left: f64,
    top: f64,
    width: f64,
    height: f64,
}

impl BBox {
    /// From left and top edge, width and height. A negative size becomes zero.
    pub fn from_ltwh(left: f64, top: f64, width: f64, height: f64) -> Self {
        Self { left, top, width: non_negative(width), height: non_negative(height) }
    }

    /// From the four edges; `right` and `bottom` are exclusive (continuous) edges.
    pub fn from_ltrb(left: f64, top: f64, right: f64, bottom: f64) -> Self {
        Self::from_ltwh(left, top, right - left, bottom - top)
    }

    /// From the centre, width and height.
    pub fn from_center_size(center: Point, width: f64, height: f64) -> Self {
        Self::from_ltwh(center.x - width / 2.0, center.y - height / 2.0, width, height)
    }

    /// Left edge.
    pub const fn left(&self) -> f64 {
        self.left
    }

    /// Top edge.
    pub const fn top(&self) -> f64 {
        self.top
    }

    /// Right edge (exclusive).
    pub fn right(&self) -> f64 {
        self.left + self.width
    }

    /// Bottom edge (exclusive).
    pub fn bottom(&self) -> f64 {
        self.top + self.height
    }

    /// Width, ≥ 0.
    pub const fn width(&self) -> f64 {
        self.width
    }

    /// Height, ≥ 0.
    pub const fn height(&self) -> f64 {
        self.height
    }

    /// The centre.
    pub fn center(&self) -> Point {
        Point::new(self.left + self.width / 2.0, self.top + self.height / 2.0)
    }

    /// Area in square pixels.
    pub fn area(&self) -> f64 {
        self.width * self.height
    }

    /// `(left, top, width, height)`.
    pub const fn ltwh(&self) -> (f64, f64, f64, f64) {
        (self.left, self.top, self.width, self.height)
    }

    /// Whether all four numbers are finite.
    pub fn is_finite(&self) -> bool {
        self.left.is_finite() && self.top.is_finite() && self.width.is_finite() && self.height.is_finite()
    }

    /// Whether the box covers nothing.
    pub fn is_empty(&self) -> bool {
        // Written so that NaN counts as empty.
        !(self.width > 0.0 && self.height > 0.0)
    }

    /// The common part of two boxes, `None` when they do not overlap.
    pub fn intersection(&self, other: &Self) -> Option<Self> {
        let left = self.left.max(other.left);
        let top = self.top.max(other.top);
        let right = self.right().min(other.right());
        let bottom = self.bottom().min(other.bottom());
        // `max` and `min` pass over NaN, so it must be caught here; most boxes that are asked about are apart.
        let overlap = right > left && bottom > top && self.is_finite() && other.is_finite();
        overlap.then(|| Self::from_ltrb(left, top, right, bottom))
    }

    /// Intersection over union (Jaccard overlap), in `[0, 1]`; 0 when either box is empty.
    pub fn iou(&self, other: &Self) -> f64 {
        let Some(common) = self.intersection(other) else { return 0.0 };
        let union = self.area() + other.area() - common.area();
        if union > 0.0 { (common.area() / union).clamp(0.0, 1.0) } else { 0.0 }
    }

    /// The fraction of this box's area that lies inside `other`, in `[0, 1]`.
    pub fn fraction_inside(&self, other: &Self) -> f64 {
        match self.intersection(other) {
            Some(common) if self.area() > 0.0 => (common.area() / self.area()).clamp(0.0, 1.0),
            _ => 0.0,
        }
    }

    /// The smallest box that holds both.
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        Self::from_ltrb(
            self.left.min(other.left),
            self.top.min(other.top),
            self.right().max(other.right()),
            self.bottom().max(other.bottom()),
        )
    }

    /// The part inside an image of the given size, `None` when nothing is.
    pub fn clipped_to(&self, size: Size) -> Option<Self> {
        self.intersection(&size.bounds())
    }

    /// Moved by `(dx, dy)` pixels.
    #[must_use]
    pub fn translated(&self, dx: f64, dy: f64) -> Self {
        Self { left: self.left + dx, top: self.top + dy, ..*self }
    }

    /// Moved so that its centre is `center`.
    #[must_use]
    pub fn centered_at(&self, center: Point) -> Self {
        Self::from_center_size(center, self.width, self.height)
    }

    /// Scaled by `factor` about its own centre.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        Self::from_center_size(self.center(), self.width * factor, self.height * factor)
    }

    /// The same box in an image whose sides are `factor` times as long.
    #[must_use]
    pub fn resized(&self, factor: f64) -> Self {
        Self::from_ltwh(factor * self.left, factor * self.top, factor * self.width, factor * self.height)
    }

    /// Grown by `margin_px` on every side (shrunk when negative).
    #[must_use]
    pub fn expanded(&self, margin_px: f64) -> Self {
        Self::from_center_size(self.center(), self.width + 2.0 * margin_px, self.height + 2.0 * margin_px)
    }

    /// Whether the point lies inside (left and top edge inclusive).
    pub fn contains(&self, point: Point) -> bool {
        point.x >= self.left && point.x < self.right() && point.y >= self.top && point.y < self.bottom()
    }
}

impl std::fmt::Display for BBox {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:.1},{:.1},{:.1},{:.1}", self.left, self.top, self.width, self.height)
    }
}

fn non_negative(size: f64) -> f64 {
    // `max` would turn NaN into 0 and hide it; keep NaN visible to `is_finite`.
    if size < 0.0 { 0.0 } else { size }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn any_box() -> impl Strategy<Value = BBox> {
        (-1e4..1e4, -1e4..1e4, 0.0..1e4, 0.0..1e4).prop_map(|(l, t, w, h)| BBox::from_ltwh(l, t, w, h))
    }

    /// Counts unit cells: the slow, obvious reference of `iou` for boxes with whole-pixel edges.
    fn iou_by_counting(a: &BBox, b: &BBox) -> f64 {
        let inside = |b: &BBox, x: i32, y: i32| b.contains(Point::new(f64::from(x) + 0.5, f64::from(y) + 0.5));
        let (mut both, mut any) = (0, 0);
        for y in -60..60 {
            for x in -60..60 {
                both += i32::from(inside(a, x, y) && inside(b, x, y));
                any += i32::from(inside(a, x, y) || inside(b, x, y));
            }
        }
        if any == 0 { 0.0 } else { f64::from(both) / f64::from(any) }
    }

    proptest! {
        #[test]
        fn iou_is_bounded_and_symmetric(a in any_box(), b in any_box()) {
            let iou = a.iou(&b);
            prop_assert!((0.0..=1.0).contains(&iou));
            prop_assert_eq!(iou, b.iou(&a));
        }

        #[test]
        fn iou_equals_counting_cells(v in proptest::array::uniform8(-25i32..25)) {
            let make = |c: &[i32]| BBox::from_ltwh(
                c[0].into(), c[1].into(), c[2].abs().into(), c[3].abs().into());
            let (a, b) = (make(&v[..4]), make(&v[4..]));
            prop_assert!((a.iou(&b) - iou_by_counting(&a, &b)).abs() < 1e-12);
        }

        #[test]
        fn constructors_agree(b in any_box()) {
            let again = BBox::from_ltrb(b.left(), b.top(), b.right(), b.bottom());
            let centred = BBox::from_center_size(b.center(), b.width(), b.height());
            prop_assert!((again.width() - b.width()).abs() < 1e-9 && (again.height() - b.height()).abs() < 1e-9);
            prop_assert!((centred.left() - b.left()).abs() < 1e-9 && (centred.top() - b.top()).abs() < 1e-9);
        }
    }

    #[test]
    fn empty_and_non_finite_boxes_overlap_nothing() {
        let b = BBox::from_ltwh(0.0, 0.0, 10.0, 10.0);
        for bad in [
            BBox::from_ltwh(2.0, 2.0, 0.0, 5.0),
            BBox::from_ltwh(2.0, 2.0, -3.0, 5.0),
            BBox::from_ltwh(f64::NAN, 0.0, 5.0, 5.0),
            BBox::from_ltwh(0.0, 0.0, f64::NAN, 5.0),
        ] {
            assert_eq!(b.iou(&bad), 0.0, "{bad:?}");
            assert_eq!(bad.iou(&bad), 0.0, "{bad:?}");
        }
        assert!(BBox::from_ltwh(0.0, 0.0, f64::NAN, 5.0).is_empty());
        assert!(!BBox::from_ltwh(0.0, 0.0, f64::NAN, 5.0).is_finite());
    }

    #[test]
    fn a_resized_box_is_where_it_was_in_the_resized_image() {
        let (bbox, size) = (BBox::from_ltwh(30.0, -6.0, 12.0, 90.0), Size::new(90, 60));
        let small = bbox.resized(1.0 / 3.0);
        assert!((small.iou(&BBox::from_ltwh(10.0, -2.0, 4.0, 30.0)) - 1.0).abs() < 1e-12, "{small}");
        assert_eq!(size.bounds().resized(2.0), Size::new(180, 120).bounds());
        assert_eq!(bbox.resized(1.0), bbox);
    }
}
