use crate::mechanics::AxisLimits;

/// What one axis knows when a command is made: the head and the target at the moment when the command takes effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct AxisAim {
    /// The head's angle, degrees.
    pub head_deg: f64,
    /// The head's speed, degrees per second.
    pub head_deg_s: f64,
    /// How far the target is ahead of the head, degrees.
    pub away_deg: f64,
    /// The target's speed, degrees per second.
    pub target_deg_s: f64,
}

impl AxisAim {
    /// The speed to command, degrees per second: the target's, and what closes the distance.
    ///
    /// While the head comes to the target's speed within its acceleration, the distance changes by
    /// `(v_t − v_h) |v_t − v_h| / 2a`; that is counted in. The distance is closed at `gain` per second, but never faster
    /// than the head can brake.
    pub fn speed_deg_s(&self, gain_per_s: f64, limits: &AxisLimits) -> f64 {
        let acceleration = limits.max_acceleration_deg_s2;
        // Beyond the ends of the travel there is nothing to follow.
        let goal = (self.head_deg + self.away_deg).clamp(limits.min_deg, limits.max_deg);
        let away = goal - self.head_deg;
        let at_the_end = goal != self.head_deg + self.away_deg;
        let target = if at_the_end { 0.0 } else { self.target_deg_s };
        let slower = target - self.head_deg_s;
        let distance = away + slower * slower.abs() / (2.0 * acceleration);
        let closing = (gain_per_s * distance.abs()).min((1.6 * acceleration * distance.abs()).sqrt());
        (target + closing.copysign(distance)).clamp(-limits.max_speed_deg_s, limits.max_speed_deg_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: AxisLimits = AxisLimits { max_speed_deg_s: 60.0, max_acceleration_deg_s2: 100.0, ..AxisLimits::PAN };

    fn aim(away_deg: f64, target_deg_s: f64, head_deg_s: f64) -> AxisAim {
        AxisAim { head_deg: 0.0, head_deg_s, away_deg, target_deg_s }
    }

    #[test]
    fn the_targets_speed_is_matched_and_the_distance_closed() {
        assert_eq!(aim(0.0, 15.0, 15.0).speed_deg_s(3.0, &LIMITS), 15.0);
        assert_eq!(aim(2.0, 0.0, 0.0).speed_deg_s(3.0, &LIMITS), 6.0);
        assert_eq!(aim(-2.0, 10.0, 10.0).speed_deg_s(3.0, &LIMITS), 4.0);
    }

    #[test]
    fn coming_to_speed_costs_distance() {
        // 20°/s slower than the target: 400 / 200 = 2° are lost on the way.
        assert_eq!(aim(0.0, 20.0, 0.0).speed_deg_s(3.0, &LIMITS), 26.0);
        // 20°/s faster: 2° are gained while braking, so at 2° behind it brakes to the target's speed.
        assert_eq!(aim(2.0, 0.0, 20.0).speed_deg_s(3.0, &LIMITS), 0.0);
    }

    #[test]
    fn large_distances_are_closed_no_faster_than_can_be_braked() {
        let speed = aim(10.0, 0.0, 0.0).speed_deg_s(50.0, &LIMITS);
        assert_eq!(speed, 1600f64.sqrt());
        assert_eq!(aim(90.0, 0.0, 0.0).speed_deg_s(3.0, &LIMITS), 60.0);
        assert_eq!(aim(-90.0, 0.0, 0.0).speed_deg_s(3.0, &LIMITS), -60.0);
    }

    #[test]
    fn the_end_of_the_travel_is_approached_and_kept() {
        let at_end = AxisAim { head_deg: 170.0, head_deg_s: 0.0, away_deg: 30.0, target_deg_s: 20.0 };
        assert_eq!(at_end.speed_deg_s(3.0, &LIMITS), 0.0);
        let before = AxisAim { head_deg: 169.0, ..at_end };
        assert_eq!(before.speed_deg_s(3.0, &LIMITS), 3.0);
    }
}
