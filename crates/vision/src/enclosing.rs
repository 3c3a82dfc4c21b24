//! The smallest rectangle around a convex hull.

use pursuit_geometry::{Point, Polygon};

/// A rectangle at any angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RotatedRectangle {
    /// Its centre.
    pub center: Point,
    /// Side along [`angle_rad`](Self::angle_rad), in pixels.
    pub width: f64,
    /// The other side, in pixels.
    pub height: f64,
    /// Direction of the first side against the x axis, in `(−π/2, π/2]`, towards y (clockwise on the screen).
    pub angle_rad: f64,
}

impl RotatedRectangle {
    /// Area in square pixels.
    pub fn area(&self) -> f64 {
        self.width * self.height
    }

    /// The four corners in order.
    pub fn polygon(&self) -> Polygon {
        let (sin, cos) = self.angle_rad.sin_cos();
        let corner = |u: f64, v: f64| {
            let (u, v) = (u * self.width / 2.0, v * self.height / 2.0);
            Point::new(self.center.x + u * cos - v * sin, self.center.y + u * sin + v * cos)
        };
        Polygon::new(vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)])
    }
}

/// The rectangle of least area, at any angle, that holds a convex hull; `None` without points.
///
/// One of its sides lies along an edge of the hull, so trying every edge suffices (Freeman and Shapira, 1975).
pub fn smallest_rectangle(hull: &[Point]) -> Option<RotatedRectangle> {
    let first = *hull.first()?;
    let mut best: Option<RotatedRectangle> = None;
    for (i, &a) in hull.iter().enumerate() {
        let b = hull[(i + 1) % hull.len()];
        let length = a.distance(b);
        if length == 0.0 {
            continue;
        }
        let rectangle = rectangle_along(hull, (b.x - a.x) / length, (b.y - a.y) / length);
        if best.is_none_or(|have| rectangle.area() < have.area()) {
            best = Some(rectangle);
        }
    }
    Some(best.unwrap_or(RotatedRectangle { center: first, width: 0.0, height: 0.0, angle_rad: 0.0 }))
}

fn rectangle_along(hull: &[Point], cos: f64, sin: f64) -> RotatedRectangle {
    let (mut low_u, mut high_u) = (f64::INFINITY, f64::NEG_INFINITY);
    let (mut low_v, mut high_v) = (f64::INFINITY, f64::NEG_INFINITY);
    for p in hull {
        let (u, v) = (p.x * cos + p.y * sin, p.y * cos - p.x * sin);
        (low_u, high_u) = (low_u.min(u), high_u.max(u));
        (low_v, high_v) = (low_v.min(v), high_v.max(v));
    }
    let (u, v) = (f64::midpoint(low_u, high_u), f64::midpoint(low_v, high_v));
    let angle = sin.atan2(cos);
    // A rectangle turned by half a circle is the same one.
    let half_turn = std::f64::consts::PI;
    let angle_rad = if angle > half_turn / 2.0 {
        angle - half_turn
    } else if angle <= -half_turn / 2.0 {
        angle + half_turn
    } else {
        angle
    };
    RotatedRectangle {
        center: Point::new(u * cos - v * sin, u * sin + v * cos),
        width: high_u - low_u,
        height: high_v - low_v,
        angle_rad,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contour::convex_hull;
    use proptest::prelude::*;

    include!("../tests/fixtures/enclosing.rs");

    fn points(raw: &[(i32, i32)]) -> Vec<Point> {
        raw.iter().map(|&(x, y)| Point::new(x.into(), y.into())).collect()
    }

    fn hull_of(raw: &[(i32, i32)]) -> Vec<Point> {
        let mut hull = Vec::new();
        convex_hull(&mut points(raw), &mut hull);
        hull
    }

    #[test]
    fn rectangles_are_those_of_opencv() {
        for (raw, area, _) in CLOUDS {
            let hull = hull_of(raw);
            let rectangle = smallest_rectangle(&hull).unwrap();
            assert!((rectangle.area() - area).abs() < 1e-3 * (1.0 + area), "{rectangle:?} {area}");
        }
    }

    proptest! {
        #[test]
        fn enclosing_shape_is_the_smallest(
            raw in proptest::collection::vec((0i32..40, 0i32..40), 1..30), angle in 0.0..3.2f64,
        ) {
            let hull = hull_of(&raw);
            let rectangle = smallest_rectangle(&hull).unwrap();
            let (sin, cos) = rectangle.angle_rad.sin_cos();
            for p in points(&raw) {
                let (dx, dy) = (p.x - rectangle.center.x, p.y - rectangle.center.y);
                prop_assert!((dx * cos + dy * sin).abs() <= rectangle.width / 2.0 + 1e-9);
                prop_assert!((dy * cos - dx * sin).abs() <= rectangle.height / 2.0 + 1e-9);
            }
            prop_assert!(rectangle_along(&hull, angle.cos(), angle.sin()).area() >= rectangle.area() - 1e-9);
            prop_assert!((rectangle.polygon().area() - rectangle.area()).abs() < 1e-6);
        }
    }
}
