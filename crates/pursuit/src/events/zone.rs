use crate::RunError;
use pursuit_geometry::Point;
use std::str::FromStr;
use std::sync::Arc;

/// A polygon in the picture with a name, in pixels of the input, written `NAME=X,Y,X,Y,X,Y…`.
#[derive(Debug, Clone, PartialEq)]
pub struct Zone {
    /// Letters, digits, `-` and `_`: it becomes a part of topics.
    pub name: Arc<str>,
    /// Its corners in order, three or more.
    corners: Vec<Point>,
}

impl Zone {
    /// How far outside a point is, pixels; below 0 inside.
    pub fn outside_by(&self, point: Point) -> f64 {
        let next = self.corners.iter().cycle().skip(1);
        let (mut inside, mut nearest) = (false, f64::INFINITY);
        for (a, b) in self.corners.iter().zip(next) {
            nearest = nearest.min(distance(point, *a, *b));
            // A ray to the right crosses an odd number of edges from inside.
            let crosses =
                (a.y > point.y) != (b.y > point.y) && point.x < a.x + (point.y - a.y) / (b.y - a.y) * (b.x - a.x);
            inside ^= crosses;
        }
        if inside { -nearest } else { nearest }
    }
}

/// From a point to a piece of a line.
fn distance(point: Point, a: Point, b: Point) -> f64 {
    let (dx, dy) = (b.x - a.x, b.y - a.y);
    let length = dx * dx + dy * dy;
    let along = if length > 0.0 { ((point.x - a.x) * dx + (point.y - a.y) * dy) / length } else { 0.0 };
    let along = along.clamp(0.0, 1.0);
    point.distance(Point::new(a.x + along * dx, a.y + along * dy))
}

impl FromStr for Zone {
    type Err = RunError;

    /// # Errors
    /// [`RunError::Usage`] for a name that is none of a topic, and less than three corners.
    fn from_str(text: &str) -> Result<Self, RunError> {
        let wrong = |why: &str| {
            RunError::usage(format!(
                "zone `{text}`: {why}; give NAME=X,Y,X,Y,X,Y… in pixels, for example door=0,0,90,0,90,200"
            ))
        };
        let (name, numbers) = text.split_once('=').ok_or_else(|| wrong("it has no name"))?;
        let name = name.trim();
        let fits = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if name.is_empty() || !name.chars().all(fits) {
            return Err(wrong("a name has letters from A to Z, digits, - and _ alone"));
        }
        let number = |n: &str| n.trim().parse().ok().filter(|v: &f64| v.is_finite());
        let numbers: Option<Vec<f64>> = numbers.split(',').map(number).collect();
        let numbers = numbers.ok_or_else(|| wrong("its corners are no numbers"))?;
        let (pairs, rest) = numbers.as_chunks::<2>();
        if !rest.is_empty() || pairs.len() < 3 {
            return Err(wrong("a polygon has three corners or more, of two numbers each"));
        }
        Ok(Self { name: name.into(), corners: pairs.iter().map(|[x, y]| Point::new(*x, *y)).collect() })
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    #[test]
    fn inside_is_negative_by_the_distance_to_the_edge() {
        // An L: its inner corner is at (10, 10).
        let zone: Zone = "l=0,0, 20,0, 20,10, 10,10, 10,20, 0,20".parse().unwrap();
        for (x, y, wanted) in [
            (5.0, 5.0, -5.0),
            (15.0, 5.0, -5.0),
            (5.0, 18.0, -2.0),
            (15.0, 15.0, 5.0),
            (-3.0, 10.0, 3.0),
            (23.0, 14.0, 5.0),
        ] {
            assert!((zone.outside_by(Point::new(x, y)) - wanted).abs() < 1e-12, "{x},{y}");
        }
    }

    #[test]
    fn what_is_no_zone_is_refused() {
        for (text, word) in [
            ("0,0,1,0,1,1", "no name"),
            ("a b=0,0,1,0,1,1", "letters"),
            ("a/+=0,0,1,0,1,1", "letters"),
            ("a=0,0,1,0", "three corners"),
            ("a=0,0,1,0,1", "three corners"),
            ("a=0,0,1,0,1,inf", "no numbers"),
        ] {
            let error = text.parse::<Zone>().unwrap_err();
            assert!(error.exit_code() == 2 && error.to_string().contains(word), "{error}");
        }
    }
}
