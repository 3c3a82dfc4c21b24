use pursuit_geometry::camera;

pursuit_parameters::parameters! {
    /// A direction, or a turn, of a head, in degrees, the unit of heads and of users' files; geometry is in radians.
    #[derive(Copy)]
    pub struct Direction {
        /// The angle to the right.
        pub pan_deg: f64 = 0.0, unit "deg";
        /// The angle upward.
        pub tilt_deg: f64 = 0.0, unit "deg";
    }
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
        self.radians().angle_to(other.radians()).to_degrees()
    }

    /// The same in radians.
    pub fn radians(&self) -> camera::Direction {
        camera::Direction { pan_rad: self.pan_deg.to_radians(), tilt_rad: self.tilt_deg.to_radians() }
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
    fn angles_on_the_sphere_are_in_degrees() {
        assert!((Direction::new(10.0, 0.0).angle_to(Direction::new(-10.0, 0.0)) - 20.0).abs() < 1e-12);
        assert!((Direction::new(0.0, 30.0).angle_to(Direction::new(0.0, -15.0)) - 45.0).abs() < 1e-12);
    }

    #[test]
    fn only_finite_angles_are_finite() {
        assert!(Direction::new(1.0, 2.0).is_finite());
        assert!(!Direction::new(f64::NAN, 2.0).is_finite() && !Direction::new(1.0, f64::INFINITY).is_finite());
    }
}
