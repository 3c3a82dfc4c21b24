use super::AxisLimits;

/// What an axis is told to do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Goal {
    /// To turn at this speed, degrees per second.
    Speed(f64),
    /// To go to this angle of the motor, degrees, and to stand there.
    Angle(f64),
}

/// One axis of a head: its motor, and the camera that follows the motor with play.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    motor_deg: f64,
    speed_deg_s: f64,
    camera_deg: f64,
    goal: Goal,
}

impl Axis {
    /// The longest step in which the motion is integrated, seconds.
    const STEP_S: f64 = 0.005;

    /// An axis at rest at `angle_deg`.
    pub const fn at(angle_deg: f64) -> Self {
        Self { motor_deg: angle_deg, speed_deg_s: 0.0, camera_deg: angle_deg, goal: Goal::Speed(0.0) }
    }

    /// Where the camera looks, degrees.
    pub const fn angle_deg(&self) -> f64 {
        self.camera_deg
    }

    /// How fast the motor turns, degrees per second.
    pub const fn speed_deg_s(&self) -> f64 {
        self.speed_deg_s
    }

    /// What it was told last.
    pub const fn goal(&self) -> Goal {
        self.goal
    }

    /// Tells it something else.
    pub const fn aim(&mut self, goal: Goal) {
        self.goal = goal;
    }

    /// Tells it to turn by `by_deg` from where its motor stands.
    pub const fn aim_by(&mut self, by_deg: f64) {
        self.goal = Goal::Angle(self.motor_deg + by_deg);
    }

    /// It stands elsewhere than was thought; where it is sent stays.
    pub fn shift(&mut self, by_deg: f64) {
        self.motor_deg += by_deg;
        self.camera_deg += by_deg;
    }

    /// Whether it turns, or will.
    pub fn moves(&self) -> bool {
        self.speed_deg_s != 0.0
            || match self.goal {
                Goal::Speed(speed) => speed != 0.0,
                Goal::Angle(angle) => (angle - self.motor_deg).abs() > 1e-9,
            }
    }

    /// Lets `seconds` pass (none when it is not positive; at most an hour).
    pub fn advance(&mut self, seconds: f64, limits: &AxisLimits) {
        if seconds.is_nan() {
            return;
        }
        let mut left = seconds.min(3600.0);
        while left > 0.0 {
            if !self.moves() {
                return;
            }
            // A ramp to a speed that never turns back, and that speed from then on, are exact in one step.
            let onward = matches!(self.goal, Goal::Speed(speed) if speed * self.speed_deg_s >= 0.0);
            let step = if onward { left } else { left.min(Self::STEP_S) };
            self.step(step, limits);
            left -= step;
        }
    }

    fn step(&mut self, dt: f64, limits: &AxisLimits) {
        let wanted = self.wanted_speed(dt, limits);
        let change = limits.max_acceleration_deg_s2 * dt;
        let speed = self.speed_deg_s + (wanted - self.speed_deg_s).clamp(-change, change);
        // The mean over the step: the ramp to the new speed, then that speed.
        let ramp = ((speed - self.speed_deg_s).abs() / limits.max_acceleration_deg_s2).min(dt);
        self.motor_deg += ramp * 0.5 * (self.speed_deg_s + speed) + (dt - ramp) * speed;
        self.speed_deg_s = speed;
        if let Goal::Angle(angle) = self.goal
            && let goal = angle.clamp(limits.min_deg, limits.max_deg)
            && (goal - self.motor_deg).abs() <= change * dt
            && speed.abs() <= change
        {
            (self.motor_deg, self.speed_deg_s) = (goal, 0.0);
            self.goal = Goal::Angle(goal);
        }
        self.stop_at_the_ends(limits);
        let play = limits.backlash_deg / 2.0;
        self.camera_deg = self.camera_deg.clamp(self.motor_deg - play, self.motor_deg + play);
    }

    /// The speed to make for: as fast as allowed, but no faster than it can still brake before the goal.
    fn wanted_speed(&self, dt: f64, limits: &AxisLimits) -> f64 {
        let wanted = match self.goal {
            Goal::Speed(speed) => speed,
            Goal::Angle(angle) => {
                let way = angle.clamp(limits.min_deg, limits.max_deg) - self.motor_deg;
                // The speed from which, after this step, the brake still ends at the goal: v dt + a dt²/2 + v²/2a = way.
                let a = limits.max_acceleration_deg_s2;
                let left = (2.0 * way.abs() / a - dt * dt).max(0.0);
                (a * ((dt * dt + left).sqrt() - dt)).copysign(way)
            }
        };
        wanted.clamp(-limits.max_speed_deg_s, limits.max_speed_deg_s)
    }

    fn stop_at_the_ends(&mut self, limits: &AxisLimits) {
        let inside = self.motor_deg.clamp(limits.min_deg, limits.max_deg);
        if inside != self.motor_deg {
            (self.motor_deg, self.speed_deg_s) = (inside, 0.0);
            self.goal = Goal::Angle(inside);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: AxisLimits = AxisLimits { max_speed_deg_s: 20.0, max_acceleration_deg_s2: 40.0, ..AxisLimits::PAN };

    #[test]
    fn a_speed_is_reached_by_a_ramp() {
        let mut axis = Axis::at(10.0);
        axis.aim(Goal::Speed(20.0));
        axis.advance(0.25, &LIMITS); // half of the ramp: ½ · 40 · 0.25² = 1.25°
        assert!((axis.angle_deg() - 11.25).abs() < 1e-9 && (axis.speed_deg_s() - 10.0).abs() < 1e-9);
        axis.advance(1.25, &LIMITS); // 5° of ramp in all, then 1 s at 20°/s
        assert!((axis.angle_deg() - 35.0).abs() < 1e-9 && (axis.speed_deg_s() - 20.0).abs() < 1e-9);
        axis.aim(Goal::Speed(0.0));
        axis.advance(5.0, &LIMITS);
        assert!((axis.angle_deg() - 40.0).abs() < 1e-9 && !axis.moves());
    }

    #[test]
    fn speeds_are_limited() {
        let mut axis = Axis::at(0.0);
        axis.aim(Goal::Speed(-500.0));
        axis.advance(1.0, &LIMITS);
        assert!((axis.speed_deg_s() + 20.0).abs() < 1e-9);
    }

    #[test]
    fn an_angle_is_reached_without_passing_it() {
        for way in [0.05, 0.7, 3.0, -30.0, 100.0] {
            let mut axis = Axis::at(1.0);
            axis.aim_by(way);
            let time = crate::mechanics::travel_time_s(way, 0.0, &LIMITS);
            let mut furthest: f64 = 0.0;
            let mut arrived = None;
            for step in 0..2000 {
                axis.advance(0.005, &LIMITS);
                furthest = furthest.max((axis.angle_deg() - 1.0) * way.signum());
                if !axis.moves() && arrived.is_none() {
                    arrived = Some(f64::from(step + 1) * 0.005);
                }
            }
            assert!((axis.angle_deg() - 1.0 - way).abs() < 1e-9, "{way}: {}", axis.angle_deg());
            assert!(furthest <= way.abs() + 1e-4, "{way}: passed by {}", furthest - way.abs());
            let arrived = arrived.unwrap();
            assert!(arrived > time - 0.02 && arrived < time + 0.15, "{way}: {arrived} instead of {time}");
        }
    }

    #[test]
    fn the_travel_ends() {
        let mut axis = Axis::at(160.0);
        axis.aim(Goal::Speed(20.0));
        axis.advance(10.0, &LIMITS);
        assert_eq!((axis.angle_deg(), axis.speed_deg_s()), (170.0, 0.0));
        axis.aim(Goal::Angle(-900.0));
        axis.advance(100.0, &LIMITS);
        assert_eq!(axis.angle_deg(), -170.0);
        assert!(!axis.moves());
    }

    #[test]
    fn the_camera_follows_with_play() {
        let limits = AxisLimits { backlash_deg: 0.5, ..LIMITS };
        let mut axis = Axis::at(0.0);
        axis.aim_by(10.0);
        axis.advance(5.0, &limits);
        assert!((axis.angle_deg() - 9.75).abs() < 1e-9);
        axis.aim_by(-0.4);
        axis.advance(5.0, &limits);
        assert!((axis.angle_deg() - 9.75).abs() < 1e-9, "within the play the camera stays");
        axis.aim_by(-1.0);
        axis.advance(5.0, &limits);
        assert!((axis.angle_deg() - 8.85).abs() < 1e-9);
    }

    #[test]
    fn time_does_not_run_backward() {
        let mut axis = Axis::at(0.0);
        axis.aim(Goal::Speed(5.0));
        let before = axis;
        axis.advance(-1.0, &LIMITS);
        axis.advance(f64::NAN, &LIMITS);
        assert_eq!(axis, before);
    }
}
