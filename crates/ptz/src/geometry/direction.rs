use serde::{Deserialize, Serialize};

/// A direction, or a turn, of a head.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Direction {
    /// Degrees to the right.
    pub pan_deg: f64,
    /// Degrees upward.
    pub tilt_deg: f64,
}

impl Direction {
    /// Straight ahead, level.
    pub const AHEAD: Self = Self { pan_deg: 0.0, tilt_deg: 0.0 };

    /// `pan_deg` to the right and `tilt_deg` upward.
    pub const fn new(pan_deg: f64, tilt_deg: f64) -> Self {
        Self { pan_deg, tilt_deg }
    }

    /// Whether both angles are finite.
    pub const fn is_finite(&self) -> bool {
        self.pan_deg.is_finite() && self.tilt_deg.is_finite()
    }

    /// The turn from `from` to here, the short way round.
    #[must_use]
    pub fn from(&self, from: Self) -> Self {
        Self::new(wrapped(self.pan_deg - from.pan_deg), self.tilt_deg - from.tilt_deg)
    }

    /// Here, turned by `by`.
    #[must_use]
    pub fn turned(&self, by: Self) -> Self {
        Self::new(self.pan_deg + by.pan_deg, self.tilt_deg + by.tilt_deg)
    }

    /// The angle between two directions on the sphere, degrees.
    pub fn angle_to(&self, other: Self) -> f64 {
        let (a, b) = (self.unit(), other.unit());
        let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
        let sine = cross.iter().map(|v| v * v).sum::<f64>().sqrt();
        let cosine: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
        sine.atan2(cosine).to_degrees()
    }

    /// The unit vector that points there: right, up, ahead.
    pub fn unit(&self) -> [f64; 3] {
        let (sin_pan, cos_pan) = self.pan_deg.to_radians().sin_cos();
        let (sin_tilt, cos_tilt) = self.tilt_deg.to_radians().sin_cos();
        [cos_tilt * sin_pan, sin_tilt, cos_tilt * cos_pan]
    }
}

/// An angle brought into (−180, 180] degrees.
fn wrapped(angle_deg: f64) -> f64 {
    let turned = angle_deg.rem_euclid(360.0);
    if turned > 180.0 { turned - 360.0 } else { turned }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_take_the_short_way_round() {
        let turn = Direction::new(-170.0, 5.0).from(Direction::new(175.0, 2.0));
        assert_eq!((turn.pan_deg, turn.tilt_deg), (15.0, 3.0));
        assert_eq!(Direction::new(180.0, 0.0).from(Direction::AHEAD).pan_deg, 180.0);
        assert_eq!(Direction::new(-175.0, 0.0).from(Direction::new(10.0, 0.0)).pan_deg, 175.0);
        assert_eq!(Direction::new(3.0, 4.0).turned(Direction::new(1.0, -2.0)), Direction::new(4.0, 2.0));
    }

    #[test]
    fn angles_on_the_sphere_shrink_towards_the_zenith() {
        let apart = |tilt: f64| Direction::new(10.0, tilt).angle_to(Direction::new(-10.0, tilt));
        assert!((apart(0.0) - 20.0).abs() < 1e-12);
        // haversine: sin(θ/2) = cos(tilt) sin(Δpan/2)
        let expected = 2.0 * (60f64.to_radians().cos() * 10f64.to_radians().sin()).asin().to_degrees();
        assert!((apart(60.0) - expected).abs() < 1e-12);
        assert!((Direction::new(0.0, 30.0).angle_to(Direction::new(0.0, -15.0)) - 45.0).abs() < 1e-12);
    }

    #[test]
    fn only_finite_angles_are_finite() {
        assert!(Direction::new(1.0, 2.0).is_finite());
        assert!(!Direction::new(f64::NAN, 2.0).is_finite() && !Direction::new(1.0, f64::INFINITY).is_finite());
    }
}
