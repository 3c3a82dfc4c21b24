use crate::Direction;
use pursuit_parameters::parameters;

parameters! {
    /// What one axis of a head can do.
    #[derive(Copy)]
    pub struct AxisLimits {
        /// Greatest speed.
        pub max_speed_deg_s: f64 = 60.0, in above(0.0).at_most(1e4), unit "deg/s";
        /// Greatest acceleration.
        pub max_acceleration_deg_s2: f64 = 120.0, in above(0.0).at_most(1e6), unit "deg/s²";
        /// The lower end of the travel.
        pub min_deg: f64 = -170.0, in -1e6..=1e6, unit "deg";
        /// The upper end of the travel.
        pub max_deg: f64 = 170.0, in -1e6..=1e6, unit "deg";
        /// How far the motor turns after a reversal before the camera follows.
        pub backlash_deg: f64 = 0.0, in 0.0..=10.0, unit "deg";
    }
    ordered { min_deg <= max_deg }
}

impl AxisLimits {
    /// A common pan axis: 60°/s, 120°/s², ±170°, no play.
    pub const PAN: Self = Self {
        max_speed_deg_s: 60.0,
        max_acceleration_deg_s2: 120.0,
        min_deg: -170.0,
        max_deg: 170.0,
        backlash_deg: 0.0,
    };

    /// A common tilt axis: 60°/s, 120°/s², −30° to 90°, no play.
    pub const TILT: Self = Self { min_deg: -30.0, max_deg: 90.0, ..Self::PAN };
}

parameters! {
    /// What a head can do.
    #[derive(Copy)]
    pub struct HeadLimits {
        /// The pan axis.
        pub pan: AxisLimits = AxisLimits::PAN;
        /// The tilt axis.
        pub tilt: AxisLimits = AxisLimits::TILT;
        /// How much of its range the zoom travels in a second.
        pub zoom_per_s: f64 = 0.3, in above(0.0).at_most(100.0);
    }
}

impl HeadLimits {
    /// The nearest direction that the head can look to.
    pub fn reachable(&self, direction: Direction) -> Direction {
        let pan = direction.pan_deg.clamp(self.pan.min_deg, self.pan.max_deg);
        Direction::new(pan, direction.tilt_deg.clamp(self.tilt.min_deg, self.tilt.max_deg))
    }

    /// The zoom as an axis of its own, in units of its range.
    pub(crate) const fn zoom_axis(&self) -> AxisLimits {
        AxisLimits {
            max_speed_deg_s: self.zoom_per_s,
            max_acceleration_deg_s2: self.zoom_per_s * 20.0,
            min_deg: 0.0,
            max_deg: 1.0,
            backlash_deg: 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_parameters::Parameters;

    #[test]
    fn limits_are_read_with_their_checks() {
        let with = |text: &str| HeadLimits::default().with("limits", &text.parse().unwrap());
        let limits = with("pan = { max_speed_deg_s = 20 }\ntilt = { min_deg = -90 }").unwrap();
        assert_eq!(limits.pan, AxisLimits { max_speed_deg_s: 20.0, ..AxisLimits::PAN });
        assert_eq!((limits.tilt.min_deg, limits.tilt.max_deg), (-90.0, 90.0), "the rest is that of a tilt axis");
        for bad in [
            "pan.max_speed_deg_s = 0",
            "pan.max_acceleration_deg_s2 = -1",
            "pan = { min_deg = 10, max_deg = 9 }",
            "tilt.max_deg = inf",
            "tilt.backlash_deg = -0.1",
            "tilt.max_speed_deg_s = nan",
            "pan.speed = 3",
        ] {
            assert!(with(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn directions_out_of_reach_are_brought_to_the_end_of_the_travel() {
        let limits = HeadLimits::default();
        assert_eq!(limits.reachable(Direction::new(-200.0, 95.0)), Direction::new(-170.0, 90.0));
        assert_eq!(limits.reachable(Direction::new(12.0, -31.0)), Direction::new(12.0, -30.0));
    }
}
