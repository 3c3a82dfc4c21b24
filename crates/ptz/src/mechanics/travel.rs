use super::AxisLimits;

/// How long an axis that turns at `speed_deg_s` takes to come to rest `way_deg` further: the shortest time under the
/// limits of speed and acceleration, seconds.
pub fn travel_time_s(way_deg: f64, speed_deg_s: f64, limits: &AxisLimits) -> f64 {
    let a = limits.max_acceleration_deg_s2;
    let top = limits.max_speed_deg_s;
    // Turned so that the way beyond the point where an immediate brake would end is positive.
    let stop = speed_deg_s * speed_deg_s.abs() / (2.0 * a);
    let (way, speed) = if way_deg >= stop { (way_deg, speed_deg_s) } else { (-way_deg, -speed_deg_s) };
    // Up to a peak and down to rest: peak² / a = way + speed² / 2a.
    let peak = (a * way + 0.5 * speed * speed).max(0.0).sqrt();
    if peak <= top {
        (2.0 * peak - speed) / a
    } else {
        let ramps = (top * top - 0.5 * speed * speed) / a;
        (2.0 * top - speed) / a + (way - ramps) / top
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: AxisLimits = AxisLimits { max_speed_deg_s: 20.0, max_acceleration_deg_s2: 40.0, ..AxisLimits::PAN };

    #[test]
    fn short_ways_are_triangles_and_long_ones_trapezoids() {
        assert_eq!(travel_time_s(0.0, 0.0, &LIMITS), 0.0);
        assert!((travel_time_s(2.5, 0.0, &LIMITS) - 0.5).abs() < 1e-12); // 2 √(2.5 / 40)
        assert!((travel_time_s(10.0, 0.0, &LIMITS) - 1.0).abs() < 1e-12); // just reaches 20°/s
        assert!((travel_time_s(-30.0, 0.0, &LIMITS) - 2.0).abs() < 1e-12);
    }

    #[test]
    fn the_speed_at_the_start_counts() {
        assert!((travel_time_s(5.0, 20.0, &LIMITS) - 0.5).abs() < 1e-12, "braking at once");
        assert!((travel_time_s(15.0, 20.0, &LIMITS) - 1.0).abs() < 1e-12, "half a second on, then braking");
        // Away from the goal: brake 0.5 s and 5°, then 15° back: 1 s of ramps and 0.25 s at 20°/s.
        assert!((travel_time_s(10.0, -20.0, &LIMITS) - 1.75).abs() < 1e-12);
        // Too fast to stop there: passes, and comes back 5°: 0.5 s + 2 √(5/40).
        assert!((travel_time_s(0.0, 20.0, &LIMITS) - (0.5 + 2.0 * 0.125f64.sqrt())).abs() < 1e-12);
    }

    #[test]
    fn directions_are_alike() {
        for (way, speed) in [(3.0, 5.0), (-2.0, 11.0), (0.3, -20.0), (40.0, 7.0)] {
            assert_eq!(travel_time_s(way, speed, &LIMITS), travel_time_s(-way, -speed, &LIMITS));
        }
    }
}
