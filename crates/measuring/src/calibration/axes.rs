//! Where the origin is, which way x goes, and which way is up.

use super::require_error;
use super::stick::click_error;
use crate::{MeasuringError, Result};
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

/// Which way y grows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Up {
    /// A quarter turn to the left of x, as on paper: upward where x goes right.
    #[default]
    Up,
    /// A quarter turn to the right of x, as pixels do: downward where x goes right.
    Down,
}

/// Origin and directions of the axes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Axes {
    /// The origin, in pixels; without one the upper left corner of the picture, or the plane's own origin.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub origin: Option<[f64; 2]>,
    /// A point toward which x goes from the origin, in pixels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub toward: Option<[f64; 2]>,
    /// Or the angle by which x is turned to the left, against right in the picture or the plane's own x; degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angle_deg: Option<f64>,
    /// Which way y grows; of a plane the places of its points say that.
    pub up: Up,
    /// How uncertain the clicks are across and down: standard deviation in pixels.
    #[serde(default = "click_error")]
    pub click_error_px: f64,
}

impl Default for Axes {
    fn default() -> Self {
        Self { origin: None, toward: None, angle_deg: None, up: Up::Up, click_error_px: click_error() }
    }
}

impl Axes {
    pub(super) fn is_default(&self) -> bool {
        *self == Self::default()
    }

    pub(super) fn check(&self) -> Result<()> {
        let wrong = |what: &str| Err(MeasuringError::Calibration(what.to_owned()));
        require_error("click_error_px of the axes", self.click_error_px)?;
        let numbers = self.origin.into_iter().chain(self.toward).flatten().chain(self.angle_deg);
        if !numbers.into_iter().all(f64::is_finite) {
            return wrong("a number of the axes is not finite; give pixels and degrees");
        }
        match (self.origin, self.toward, self.angle_deg) {
            (_, Some(_), Some(_)) => wrong("the axis has a point and an angle; leave one of them out"),
            (None, Some(_), _) => {
                wrong("the axis leads toward a point, and nothing says from where; give the origin too")
            }
            (Some(o), Some(t), _) if (o[0] - t[0]).hypot(o[1] - t[1]) <= 2.0 * self.click_error_px.max(1e-9) => {
                wrong("the axis leads from the origin to the origin; click a point that is far from it")
            }
            _ => Ok(()),
        }
    }
}

/// The rigid motion after which `origin` is 0 and `toward` lies on x, or x is turned to the left by `angle_deg`.
pub(crate) fn placed(origin: [f64; 2], toward: Option<[f64; 2]>, angle_deg: Option<f64>) -> Matrix3<f64> {
    let angle = match (toward, angle_deg) {
        (Some(to), _) => (to[1] - origin[1]).atan2(to[0] - origin[0]),
        (None, Some(degrees)) => degrees.to_radians(),
        (None, None) => 0.0,
    };
    let (s, c) = angle.sin_cos();
    let [x, y] = origin;
    Matrix3::new(c, s, -c * x - s * y, -s, c, s * x - c * y, 0.0, 0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    #[test]
    fn axes_begin_at_the_origin_and_lead_to_the_point() {
        let motion = placed([3.0, 4.0], Some([3.0, 9.0]), None);
        let at = |x: f64, y: f64| motion * Vector3::new(x, y, 1.0);
        assert!((at(3.0, 4.0) - Vector3::new(0.0, 0.0, 1.0)).norm() < 1e-12);
        assert!((at(3.0, 9.0) - Vector3::new(5.0, 0.0, 1.0)).norm() < 1e-12);
        let turned = placed([0.0, 0.0], None, Some(90.0));
        assert!((turned * Vector3::new(0.0, 2.0, 1.0) - Vector3::new(2.0, 0.0, 1.0)).norm() < 1e-12);
    }

    #[test]
    fn axes_without_sense_are_refused() {
        let axes = Axes { origin: Some([1.0, 1.0]), ..Axes::default() };
        assert!(axes.check().is_ok());
        for wrong in [
            Axes { toward: Some([1.2, 1.0]), ..axes },
            Axes { origin: None, toward: Some([9.0, 1.0]), ..axes },
            Axes { toward: Some([9.0, 1.0]), angle_deg: Some(3.0), ..axes },
            Axes { angle_deg: Some(f64::NAN), ..axes },
        ] {
            assert!(wrong.check().is_err(), "{wrong:?}");
        }
    }
}
