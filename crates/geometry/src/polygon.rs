use crate::{BBox, Point};
use serde::{Deserialize, Serialize};

/// A simple polygon in continuous pixels, vertices in order (either orientation), closed implicitly.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Polygon {
    vertices: Vec<Point>,
}

impl Polygon {
    /// From its vertices in order.
    pub fn new(vertices: Vec<Point>) -> Self {
        Self { vertices }
    }

    /// The vertices in order.
    pub fn vertices(&self) -> &[Point] {
        &self.vertices
    }

    /// Area in square pixels (shoelace formula), ≥ 0.
    pub fn area(&self) -> f64 {
        let twice: f64 = self.edges().map(|(a, b)| a.x * b.y - b.x * a.y).sum();
        twice.abs() / 2.0
    }

    /// Length of the closed outline in pixels.
    pub fn perimeter(&self) -> f64 {
        self.edges().map(|(a, b)| a.distance(b)).sum()
    }

    /// The smallest axis-aligned box that holds every vertex; `None` without vertices.
    pub fn bounds(&self) -> Option<BBox> {
        let first = self.vertices.first()?;
        let (mut l, mut t, mut r, mut b) = (first.x, first.y, first.x, first.y);
        for v in &self.vertices {
            (l, t, r, b) = (l.min(v.x), t.min(v.y), r.max(v.x), b.max(v.y));
        }
        Some(BBox::from_ltrb(l, t, r, b))
    }

    fn edges(&self) -> impl Iterator<Item = (Point, Point)> + '_ {
        let next = self.vertices.iter().cycle().skip(1);
        self.vertices.iter().zip(next).map(|(a, b)| (*a, *b))
    }
}

impl From<BBox> for Polygon {
    fn from(b: BBox) -> Self {
        Self::new(vec![
            Point::new(b.left(), b.top()),
            Point::new(b.right(), b.top()),
            Point::new(b.right(), b.bottom()),
            Point::new(b.left(), b.bottom()),
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_keeps_its_area_perimeter_and_bounds() {
        let b = BBox::from_ltwh(3.0, -2.0, 4.0, 5.0);
        let p = Polygon::from(b);
        assert_eq!((p.area(), p.perimeter(), p.bounds()), (20.0, 18.0, Some(b)));
    }

    #[test]
    fn degenerate_polygons_have_no_area() {
        assert_eq!(Polygon::default().area(), 0.0);
        assert_eq!(Polygon::default().bounds(), None);
        assert_eq!(Polygon::new(vec![Point::new(1.0, 1.0)]).area(), 0.0);
    }
}
