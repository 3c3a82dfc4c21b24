use super::MotionParams;
use crate::{Direction, Result};
use nalgebra::{Vector2, Vector4};
use pursuit_estimation::motion::ConstantVelocity;
use pursuit_estimation::{Gaussian, Imm, LinearMeasurement, MotionModel, Sojourn};

/// Where a target is believed to be, in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TargetBelief {
    /// Its direction.
    pub direction: Direction,
    /// How fast it moves across the sky, degrees per second of pan and of tilt.
    pub speed_deg_s: Direction,
    /// Standard deviations of the direction, degrees of pan and of tilt.
    pub sigma_deg: Direction,
    /// Standard deviations of the speed, degrees per second.
    pub sigma_speed_deg_s: Direction,
}

/// The motion of a target in the world: pan and tilt and their rates, under an interacting multiple model of a calm and a
/// brisk random acceleration, so that a steady walker is predicted smoothly and a turn is followed at once.
#[derive(Debug, Clone)]
pub struct TargetMotion {
    params: MotionParams,
    sojourn: Sojourn<2>,
    belief: Imm<4, 2>,
    time_s: f64,
}

impl TargetMotion {
    /// Standard deviation of the unknown speed of a new target, degrees per second.
    const UNKNOWN_SPEED_DEG_S: f64 = 20.0;

    /// A target seen for the first time, `sigma_deg` of pan and of tilt uncertain.
    ///
    /// # Errors
    /// Where a number is not finite.
    pub fn new(params: MotionParams, time_s: f64, seen: Direction, sigma_deg: Direction) -> Result<Self> {
        let speed = Self::UNKNOWN_SPEED_DEG_S.powi(2);
        let variances = Vector4::new(sigma_deg.pan_deg.powi(2), sigma_deg.tilt_deg.powi(2), speed, speed);
        let belief = Gaussian::from_variances(Vector4::new(seen.pan_deg, seen.tilt_deg, 0.0, 0.0), variances)?;
        let sojourn = Sojourn::new([params.calm_s, params.brisk_s])?;
        Ok(Self { params, sojourn, belief: Imm::new(belief, [0.5, 0.5])?, time_s })
    }

    /// When it was seen last, seconds.
    pub const fn time_s(&self) -> f64 {
        self.time_s
    }

    /// The target was seen at `seen`, `sigma_deg` uncertain. A time that is not later than the last is ignored.
    ///
    /// # Errors
    /// Where a number is not finite; the belief is then as it was.
    pub fn update(&mut self, time_s: f64, seen: Direction, sigma_deg: Direction) -> Result<()> {
        let Some(mut belief) = self.predicted(time_s)? else { return Ok(()) };
        // The pan as the belief counts it: turns add up, they do not wrap.
        let mean = *belief.combined().mean();
        let turn = seen.from(Direction::new(mean[0], mean[1]));
        let value = Vector2::new(mean[0] + turn.pan_deg, seen.tilt_deg);
        let noise = [sigma_deg.pan_deg.powi(2), sigma_deg.tilt_deg.powi(2)];
        belief.update(&LinearMeasurement::<2, 4>::select([0, 1], noise)?, &value)?;
        (self.belief, self.time_s) = (belief, time_s);
        Ok(())
    }

    /// Where the target is at `time_s`; at the last sighting for earlier times.
    ///
    /// # Errors
    /// Where the time is not finite.
    pub fn at(&self, time_s: f64) -> Result<TargetBelief> {
        let belief = self.predicted(time_s)?.unwrap_or(self.belief).combined();
        let mean: Vector4<f64> = *belief.mean();
        let sigma = belief.covariance().diagonal().map(|variance| variance.max(0.0).sqrt());
        Ok(TargetBelief {
            direction: Direction::new(mean[0], mean[1]),
            speed_deg_s: Direction::new(mean[2], mean[3]),
            sigma_deg: Direction::new(sigma[0], sigma[1]),
            sigma_speed_deg_s: Direction::new(sigma[2], sigma[3]),
        })
    }

    fn predicted(&self, time_s: f64) -> Result<Option<Imm<4, 2>>> {
        let dt = time_s - self.time_s;
        if dt <= 0.0 {
            return Ok(None);
        }
        let mut belief = self.belief;
        let models = [
            ConstantVelocity::<2>::white(self.params.calm_deg2_s3).over(dt)?,
            ConstantVelocity::<2>::white(self.params.brisk_deg2_s3).over(dt)?,
        ];
        belief.predict(&models, &self.sojourn.over(dt)?)?;
        Ok(Some(belief))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIGMA: Direction = Direction::new(0.1, 0.1);

    fn walked(until_s: f64, path: impl Fn(f64) -> f64) -> TargetMotion {
        let mut motion = TargetMotion::new(MotionParams::default(), 0.0, Direction::new(path(0.0), 5.0), SIGMA).unwrap();
        let mut time = 0.04;
        while time <= until_s {
            motion.update(time, Direction::new(path(time), 5.0), SIGMA).unwrap();
            time += 0.04;
        }
        motion
    }

    #[test]
    fn a_steady_walker_is_predicted_ahead() {
        let motion = walked(3.0, |t| 2.0 + 10.0 * t);
        let ahead = motion.at(3.5).unwrap();
        assert!((ahead.direction.pan_deg - 37.0).abs() < 0.05, "{ahead:?}");
        assert!((ahead.speed_deg_s.pan_deg - 10.0).abs() < 0.1 && ahead.speed_deg_s.tilt_deg.abs() < 1e-6);
        assert!((ahead.direction.tilt_deg - 5.0).abs() < 1e-6);
        let now = motion.at(0.0).unwrap();
        assert!((now.direction.pan_deg - (2.0 + 10.0 * motion.time_s())).abs() < 0.05, "earlier: the last sighting");
        assert!(ahead.sigma_deg.pan_deg > 2.0 * now.sigma_deg.pan_deg && now.sigma_deg.pan_deg < 0.1);
        assert!(now.sigma_speed_deg_s.pan_deg < 3.0);
    }

    #[test]
    fn a_turn_is_followed_within_a_few_frames() {
        let path = |t: f64| if t < 2.0 { 10.0 * t } else { 20.0 - 10.0 * (t - 2.0) };
        let speed = walked(2.32, path).at(2.32).unwrap().speed_deg_s.pan_deg;
        assert!((speed + 10.0).abs() < 1.5, "{speed}");
    }

    #[test]
    fn pans_add_up_beyond_half_a_turn() {
        let motion = walked(3.0, |t| {
            let pan = 170.0 + 20.0 * t;
            if pan > 180.0 { pan - 360.0 } else { pan }
        });
        let now = motion.at(3.0).unwrap();
        assert!((now.direction.pan_deg - 230.0).abs() < 0.5 && (now.speed_deg_s.pan_deg - 20.0).abs() < 0.5);
    }

    #[test]
    fn bad_numbers_change_nothing() {
        let mut motion = walked(1.0, |t| t);
        let before = motion.at(2.0).unwrap();
        assert!(motion.update(2.0, Direction::new(f64::NAN, 0.0), SIGMA).is_err());
        assert!(motion.update(f64::INFINITY, Direction::AHEAD, SIGMA).is_err());
        motion.update(0.5, Direction::new(99.0, 9.0), SIGMA).unwrap();
        assert_eq!(motion.at(2.0).unwrap(), before);
    }
}
