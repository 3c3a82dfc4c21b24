use crate::{BBox, Point};

/// A similarity transform without rotation, `dst = scale · src + offset`, named `dst_from_src` where it is used.
///
/// It maps continuous pixel coordinates of one image (a patch, a pyramid level, a network's input) to those of another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Similarity {
    scale: f64,
    offset: Point,
}

impl Similarity {
    /// The transform that changes nothing.
    pub const IDENTITY: Self = Self { scale: 1.0, offset: Point::new(0.0, 0.0) };

    /// `dst = scale · src + offset`; `scale` must be positive and finite, or `None`.
    pub fn new(scale: f64, offset: Point) -> Option<Self> {
        (scale > 0.0 && scale.is_finite() && offset.x.is_finite() && offset.y.is_finite())
            .then_some(Self { scale, offset })
    }

    /// Destination pixels per source pixel.
    pub const fn scale(&self) -> f64 {
        self.scale
    }

    /// Maps a point.
    pub fn apply(&self, p: Point) -> Point {
        Point::new(self.scale * p.x + self.offset.x, self.scale * p.y + self.offset.y)
    }

    /// Maps a box.
    pub fn apply_box(&self, b: &BBox) -> BBox {
        let corner = self.apply(Point::new(b.left(), b.top()));
        BBox::from_ltwh(corner.x, corner.y, b.width() * self.scale, b.height() * self.scale)
    }

    /// The transform the other way, `src_from_dst`.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let scale = 1.0 / self.scale;
        Self { scale, offset: Point::new(-self.offset.x * scale, -self.offset.y * scale) }
    }

    /// `self` after `first`: `c_from_b.after(&b_from_a)` is `c_from_a`.
    #[must_use]
    pub fn after(&self, first: &Self) -> Self {
        Self { scale: self.scale * first.scale, offset: self.apply(first.offset) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverse_undoes_and_composition_chains() {
        let b_from_a = Similarity::new(2.0, Point::new(3.0, -1.0)).unwrap();
        let c_from_b = Similarity::new(0.5, Point::new(-4.0, 8.0)).unwrap();
        let p = Point::new(7.0, 11.0);
        assert_eq!(b_from_a.inverse().apply(b_from_a.apply(p)), p);
        assert_eq!(c_from_b.after(&b_from_a).apply(p), c_from_b.apply(b_from_a.apply(p)));
        let b = BBox::from_ltwh(1.0, 2.0, 3.0, 4.0);
        assert_eq!(b_from_a.apply_box(&b), BBox::from_ltwh(5.0, 3.0, 6.0, 8.0));
    }

    #[test]
    fn senseless_scales_are_refused() {
        for s in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(Similarity::new(s, Point::default()), None);
        }
    }
}
