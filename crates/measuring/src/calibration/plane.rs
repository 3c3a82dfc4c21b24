//! A plane in which the target moves, by four points or more whose places on it are known.

use super::require_error;
use super::stick::click_error;
use crate::{MeasuringError, Result, Unit};
use serde::{Deserialize, Serialize};

/// Points of a plane in which the target moves, however obliquely it is seen.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plane {
    /// The unit of places on the plane.
    pub unit: Unit,
    /// Four points or more, `[pixel x, pixel y, place x, place y]`.
    pub points: Vec<[f64; 4]>,
    /// How uncertain a click is across and down: standard deviation in pixels.
    #[serde(default = "click_error")]
    pub click_error_px: f64,
    /// How uncertain a place on the plane is in x and in y: standard deviation in `unit`.
    #[serde(default)]
    pub error: f64,
}

/// The most points that may be given.
const MOST_POINTS: usize = 200;
/// Corners of a quadrangle must be this far from a line, as the area of every three of them over the square of their extent.
const LEAST_AREA: f64 = 2e-3;

impl Plane {
    pub(super) fn check(&self) -> Result<()> {
        let wrong = |what: String| Err(MeasuringError::Ruler(what));
        let n = self.points.len();
        if n < 4 {
            return wrong(format!("the plane has {n} points; click at least 4 of which no three lie on a line"));
        }
        if n > MOST_POINTS {
            return wrong(format!("the plane has {n} points; {MOST_POINTS} at most are used, give the surest"));
        }
        if self.unit == Unit::Pixel {
            return wrong(
                "places on the plane are in px; give the unit that they were measured in: m, cm, mm, …".into(),
            );
        }
        if !self.points.iter().flatten().all(|v| v.is_finite()) {
            return wrong("a point of the plane is not finite; give pixel x, pixel y, place x, place y".into());
        }
        require_error("click_error_px of the plane", self.click_error_px)?;
        require_error("error of the plane's places", self.error)?;
        for (of, points) in [("in the picture", self.pixels()), ("on the plane", self.places())] {
            if !spans(&points) {
                let which = on_a_line(&points);
                return wrong(format!(
                    "{which} of the plane lie on a line {of}, so that they say nothing of what is beside it; click 4 corners of which no three lie on a line"
                ));
            }
        }
        Ok(())
    }

    /// The points in the picture.
    pub(crate) fn pixels(&self) -> Vec<[f64; 2]> {
        self.points.iter().map(|p| [p[0], p[1]]).collect()
    }

    /// The points on the plane.
    pub(crate) fn places(&self) -> Vec<[f64; 2]> {
        self.points.iter().map(|p| [p[2], p[3]]).collect()
    }
}

/// Twice the area of a triangle.
fn area([a, b, c]: [[f64; 2]; 3]) -> f64 {
    ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).abs()
}

/// The square of the largest distance between two of the points.
fn extent(points: &[[f64; 2]]) -> f64 {
    let apart = |a: &[f64; 2], b: &[f64; 2]| (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2);
    points.iter().flat_map(|a| points.iter().map(move |b| apart(a, b))).fold(0.0, f64::max)
}

/// The least area of three of four corners, over the square of the extent of all points.
fn quality(corners: [[f64; 2]; 4], extent: f64) -> f64 {
    let [a, b, c, d] = corners;
    [[a, b, c], [a, b, d], [a, c, d], [b, c, d]].into_iter().map(area).fold(f64::INFINITY, f64::min) / extent
}

/// Whether there are four points of which no three lie on a line. Looked for greedily: the two that are farthest apart, the
/// farthest from their line, and any other.
fn spans(points: &[[f64; 2]]) -> bool {
    let all = extent(points);
    let far = |from: &dyn Fn(&[f64; 2]) -> f64| points.iter().copied().max_by(|a, b| from(a).total_cmp(&from(b)));
    let Some(&first) = points.first() else { return false };
    // Each point has its turn as the first corner: with four points that looks at the one quadrangle that there is.
    let from = |a: [f64; 2]| {
        let b = far(&|p| (p[0] - a[0]).hypot(p[1] - a[1])).unwrap_or(first);
        let c = far(&|p| area([a, b, *p])).unwrap_or(first);
        points.iter().any(|d| quality([a, b, c, *d], all) > LEAST_AREA)
    };
    all > 0.0 && points.iter().any(|a| from(*a))
}

/// Which points lie on a line, in words.
fn on_a_line(points: &[[f64; 2]]) -> String {
    let all = extent(points).max(f64::MIN_POSITIVE);
    let n = points.len().min(12);
    for i in 0..n {
        for j in i + 1..n {
            for k in j + 1..n {
                if points.len() == 4 && area([points[i], points[j], points[k]]) / all <= LEAST_AREA {
                    return format!("points {}, {} and {}", i + 1, j + 1, k + 1);
                }
            }
        }
    }
    "the points".to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane(points: &[[f64; 4]]) -> Plane {
        Plane { unit: Unit::Metre, points: points.to_vec(), click_error_px: 0.5, error: 0.0 }
    }

    const CORNERS: [[f64; 4]; 4] =
        [[100.0, 200.0, 0.0, 0.0], [900.0, 220.0, 4.0, 0.0], [1000.0, 650.0, 4.0, 3.0], [60.0, 700.0, 0.0, 3.0]];

    #[test]
    fn four_corners_make_a_plane() {
        assert!(plane(&CORNERS).check().is_ok());
        let more = [&CORNERS[..], &[[500.0, 400.0, 2.0, 1.0], [510.0, 500.0, 2.0, 2.0]]].concat();
        assert!(plane(&more).check().is_ok());
    }

    #[test]
    fn what_spans_no_plane_is_named() {
        let mut line = CORNERS;
        line[2] = [500.0, 210.0, 2.0, 0.0];
        assert!(plane(&line).check().unwrap_err().to_string().contains("points 1, 2 and 3"));
        let all: Vec<[f64; 4]> = (0..6).map(|k| [f64::from(k) * 50.0, 7.0, f64::from(k), 3.0]).collect();
        assert!(plane(&all).check().unwrap_err().to_string().contains("the points of the plane lie on a line"));
        let mut one_off = all;
        one_off[5] = [100.0, 400.0, 2.0, 9.0];
        assert!(plane(&one_off).check().is_err());
        assert!(plane(&CORNERS[..3]).check().unwrap_err().to_string().contains("at least 4"));
        assert!(plane(&[CORNERS[0]; 4]).check().is_err());
        assert!(plane(&[[f64::NAN; 4]; 4]).check().is_err());
        assert!(Plane { unit: Unit::Pixel, ..plane(&CORNERS) }.check().is_err());
        assert!(Plane { error: -1.0, ..plane(&CORNERS) }.check().is_err());
    }
}
