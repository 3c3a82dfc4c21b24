use super::MotionParams;
use super::jitter::Jitter;
use crate::{Direction, Result};
use nalgebra::{SMatrix, SVector, Vector2};
use pursuit_estimation::motion::ConstantVelocity;
use pursuit_estimation::{Gaussian, Imm, LinearMeasurement, MotionModel, Sojourn, Transition};

/// Where a target is believed to be, in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TargetBelief {
    /// Its direction.
    pub direction: Direction,
    /// How fast it moves across the sky, degrees per second of pan and of tilt.
    pub speed_deg_s: Direction,
    /// Standard deviations of the direction, degrees of pan and of tilt.
    pub sigma_deg: Direction,
    /// By how much longer than assumed commands and pictures take together, seconds.
    pub late_s: f64,
}

/// A direction in which a target was seen, and how the head turned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeenAt {
    /// Where it was seen, if the head stood where its model says.
    pub direction: Direction,
    /// Standard deviation of that, degrees of pan and of tilt.
    pub sigma_deg: Direction,
    /// How fast the head turned, by its model, degrees per second.
    pub turning_deg_s: Direction,
    /// By how much longer than assumed commands and pictures together were taken to take for `direction`, seconds.
    pub late_s: f64,
    /// By how much the head may have come apart from its model since the sighting before
    /// ([`HeadModel::drift`](super::HeadModel::drift)), (degrees per second)² of pan and of tilt.
    pub drift: Direction,
}

/// The motion of a target in the world: pan and tilt and their rates, under an interacting multiple model of a calm and a
/// brisk random acceleration, so that a steady walker is predicted smoothly and a turn is followed at once.
///
/// The fifth component is by how much longer than assumed commands and pictures take together. A head that turns at `ω`
/// and obeys `δ` late stands `ω δ` behind its model, and a target is then seen that much ahead: `z = θ + ω δ`. When the
/// head changes its speed that tells `δ` from the target's own motion, so the delays are corrected while following. Left
/// out, a delay that is wrong makes the target seem to run ahead of every motion of the head, and the loop swings.
#[derive(Debug, Clone)]
pub struct TargetMotion {
    params: MotionParams,
    sojourn: Sojourn<2>,
    belief: Imm<5, 2>,
    time_s: f64,
    jitter: Jitter,
}

impl TargetMotion {
    /// Standard deviation of the unknown speed of a new target, degrees per second.
    const UNKNOWN_SPEED_DEG_S: f64 = 15.0;

    /// A target seen for the first time; `late` is what is already known of the delay: mean and standard deviation.
    ///
    /// # Errors
    /// Where a number is not finite.
    pub fn new(params: MotionParams, time_s: f64, seen: &SeenAt, late: (f64, f64)) -> Result<Self> {
        let speed = Self::UNKNOWN_SPEED_DEG_S.powi(2);
        let (mean, sigma) = late;
        let (pan, tilt) = (seen.sigma_deg.pan_deg.powi(2), seen.sigma_deg.tilt_deg.powi(2));
        let variances = SVector::from([pan, tilt, speed, speed, sigma.max(1e-4).powi(2)]);
        let Direction { pan_deg, tilt_deg } = seen.direction;
        let belief = Gaussian::from_variances(SVector::from([pan_deg, tilt_deg, 0.0, 0.0, mean]), variances)?;
        let sojourn = Sojourn::new([params.calm_s, params.brisk_s])?;
        let jitter = Jitter::new(params.jitter_s, params.picture_jitter_s, params.measure_jitter);
        Ok(Self { params, sojourn, belief: Imm::new(belief, [0.8, 0.2])?, time_s, jitter })
    }

    /// When it was seen last, seconds.
    pub const fn time_s(&self) -> f64 {
        self.time_s
    }

    /// What is known of the delay: mean and standard deviation, seconds.
    pub fn late_s(&self) -> (f64, f64) {
        let belief = self.belief.combined();
        (belief.mean()[4], belief.covariance()[(4, 4)].max(0.0).sqrt())
    }

    /// How much delays vary from command to command and from picture to picture, as measured so far.
    pub const fn jitter(&self) -> &Jitter {
        &self.jitter
    }

    /// With what another target's sightings told of the jitter.
    #[must_use]
    pub const fn knowing(mut self, jitter: Jitter) -> Self {
        self.jitter = jitter;
        self
    }

    /// All directions are counted from elsewhere: what was at 0 is at `by`.
    ///
    /// # Errors
    /// Where a number is not finite; the belief is then as it was.
    pub fn shift(&mut self, by: Direction) -> Result<()> {
        self.moved(SVector::from([by.pan_deg, by.tilt_deg, 0.0, 0.0, 0.0]))
    }

    /// What is assumed of commands and pictures together has changed: they take by `by_s` longer than assumed than was believed.
    ///
    /// # Errors
    /// Where the number is not finite; the belief is then as it was.
    pub fn later(&mut self, by_s: f64) -> Result<()> {
        self.moved(SVector::from([0.0, 0.0, 0.0, 0.0, by_s]))
    }

    fn moved(&mut self, by: SVector<f64, 5>) -> Result<()> {
        let [calm, brisk] = self.belief.beliefs();
        let shifted = |of: &Gaussian<5>| Gaussian::new(of.mean() + by, *of.covariance());
        let probabilities = (*self.belief.probabilities()).into();
        self.belief = Imm::from_beliefs([shifted(calm)?, shifted(brisk)?], probabilities)?;
        Ok(())
    }

    /// The target was seen again. A time that is earlier than the last is ignored; pictures that arrive together count together. Gives
    /// back the logarithm of how likely the sighting was, but for a constant; surprises beyond three deviations count as three.
    ///
    /// # Errors
    /// Where a number is not finite; the belief is then as it was.
    pub fn update(&mut self, time_s: f64, seen: &SeenAt) -> Result<f64> {
        if time_s < self.time_s {
            return Ok(0.0);
        }
        let drift = self.jitter.drift_deg2(seen.drift);
        let mut belief = self.predicted(time_s, drift)?.unwrap_or(self.belief);
        // The pan as the belief counts it: turns add up, they do not wrap.
        let mean = *belief.combined().mean();
        let turn = seen.direction.from(Direction::new(mean[0], mean[1]));
        let turning = seen.turning_deg_s;
        // `direction` is by where the head stood that much earlier: put back to where it stood by its model.
        let (back_pan, back_tilt) = (turning.pan_deg * seen.late_s, turning.tilt_deg * seen.late_s);
        let value = Vector2::new(mean[0] + turn.pan_deg + back_pan, seen.direction.tilt_deg + back_tilt);
        let mut matrix = SMatrix::<f64, 2, 5>::identity();
        (matrix[(0, 4)], matrix[(1, 4)]) = (turning.pan_deg, turning.tilt_deg);
        let passing = Direction::new(turning.pan_deg - mean[2], turning.tilt_deg - mean[3]);
        let blur = self.jitter.blur_deg2(passing);
        let noise = [seen.sigma_deg.pan_deg.powi(2) + blur.pan_deg, seen.sigma_deg.tilt_deg.powi(2) + blur.tilt_deg];
        let noise = SMatrix::from_diagonal(&SVector::from(noise));
        let off = value - matrix * mean;
        let expected = matrix * belief.combined().covariance() * matrix.transpose() + noise;
        belief.update(&LinearMeasurement::new(matrix, noise)?, &value)?;
        let mut likely = 0.0;
        for (axis, (drift, passing)) in
            [(seen.drift.pan_deg, passing.pan_deg), (seen.drift.tilt_deg, passing.tilt_deg)].into_iter().enumerate()
        {
            let (square, expected) = (off[axis].powi(2), expected[(axis, axis)]);
            likely -= 0.5 * ((square / expected).min(9.0) + expected.max(f64::MIN_POSITIVE).ln());
            self.jitter.learn(square, expected, drift, passing.powi(2), time_s - self.time_s);
        }
        (self.belief, self.time_s) = (belief, time_s);
        Ok(likely)
    }

    /// Where the target is at `time_s`; at the last sighting for earlier times.
    ///
    /// A speed that is not significant is not believed in whole: of a speed `v` known to `σ` the part `v² / (v² + σ²)` is,
    /// the share of the signal in what was measured.
    ///
    /// # Errors
    /// Where the time is not finite.
    pub fn at(&self, time_s: f64) -> Result<TargetBelief> {
        let now = self.belief.combined();
        let ahead = self.predicted(time_s, Direction::AHEAD)?.unwrap_or(self.belief).combined();
        let ahead_s = (time_s - self.time_s).max(0.0);
        let axis = |i: usize| {
            let (speed, variance) = (now.mean()[i + 2], now.covariance()[(i + 2, i + 2)].max(0.0));
            let square = speed * speed;
            // A speed of several deviations is beyond doubt: past 3 σ it is taken whole.
            let doubt = (1.0 - square / (9.0 * variance.max(f64::MIN_POSITIVE))).max(0.0);
            let speed = if square > 0.0 { speed * square / (square + doubt * variance) } else { 0.0 };
            (now.mean()[i] + speed * ahead_s, speed, ahead.covariance()[(i, i)].max(0.0).sqrt())
        };
        let ((pan, pan_speed, pan_sigma), (tilt, tilt_speed, tilt_sigma)) = (axis(0), axis(1));
        Ok(TargetBelief {
            direction: Direction::new(pan, tilt),
            speed_deg_s: Direction::new(pan_speed, tilt_speed),
            sigma_deg: Direction::new(pan_sigma, tilt_sigma),
            late_s: now.mean()[4],
        })
    }

    fn predicted(&self, time_s: f64, drift_deg2: Direction) -> Result<Option<Imm<5, 2>>> {
        let dt = time_s - self.time_s;
        if dt <= 0.0 {
            return Ok(None);
        }
        let mut belief = self.belief;
        let model = |density| self.transition(density, dt, drift_deg2);
        let models = [model(self.params.calm_deg2_s3)?, model(self.params.brisk_deg2_s3)?];
        belief.predict(&models, &self.sojourn.over(dt)?)?;
        Ok(Some(belief))
    }

    /// Constant velocity for pan and tilt, and a delay that hardly wanders.
    fn transition(&self, density: f64, dt: f64, drift_deg2: Direction) -> Result<Transition<5>> {
        let motion: Transition<4> = ConstantVelocity::<2>::white(density).over(dt)?;
        let mut matrix = SMatrix::<f64, 5, 5>::identity();
        matrix.fixed_view_mut::<4, 4>(0, 0).copy_from(motion.matrix());
        let mut noise = SMatrix::<f64, 5, 5>::zeros();
        noise.fixed_view_mut::<4, 4>(0, 0).copy_from(motion.noise());
        noise[(0, 0)] += drift_deg2.pan_deg;
        noise[(1, 1)] += drift_deg2.tilt_deg;
        noise[(4, 4)] = Self::LATE_WANDERS_S2_S * dt;
        Ok(Transition::new(matrix, noise)?)
    }

    /// How fast the delay may wander, s²/s: 3 ms within a second.
    const LATE_WANDERS_S2_S: f64 = 1e-5;
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIGMA: Direction = Direction::new(0.1, 0.1);

    fn seen(pan: f64) -> SeenAt {
        SeenAt {
            direction: Direction::new(pan, 5.0),
            sigma_deg: SIGMA,
            turning_deg_s: Direction::AHEAD,
            late_s: 0.0,
            drift: Direction::AHEAD,
        }
    }

    fn walked(until_s: f64, path: impl Fn(f64) -> f64) -> TargetMotion {
        let mut motion = TargetMotion::new(MotionParams::default(), 0.0, &seen(path(0.0)), (0.0, 0.05)).unwrap();
        let mut time = 0.04;
        while time <= until_s {
            motion.update(time, &seen(path(time))).unwrap();
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
        assert!(motion.update(2.0, &seen(f64::NAN)).is_err());
        assert!(motion.update(f64::INFINITY, &seen(1.0)).is_err());
        motion.update(0.5, &seen(99.0)).unwrap();
        assert_eq!(motion.at(2.0).unwrap(), before);
    }

    #[test]
    fn a_wrong_delay_is_found_when_the_head_changes_its_speed() {
        // The target stands at 10°. The head swings to and fro and obeys 60 ms later than its model.
        let params = MotionParams::default();
        let see = |time: f64| {
            let (angle, speed) = (5.0 * (2.0 * time).sin(), 10.0 * (2.0 * time).cos());
            let truth = 5.0 * (2.0 * (time - 0.06)).sin();
            let turning_deg_s = Direction::new(speed, 0.0);
            SeenAt {
                direction: Direction::new(10.0 + angle - truth, 5.0),
                sigma_deg: SIGMA,
                turning_deg_s,
                late_s: 0.0,
                drift: Direction::AHEAD,
            }
        };
        let mut motion = TargetMotion::new(params, 0.0, &see(0.0), (0.0, 0.05)).unwrap();
        for k in 1..800 {
            let time = f64::from(k) * 0.04;
            motion.update(time, &see(time)).unwrap();
        }
        let (late, sigma) = motion.late_s();
        assert!((late - 0.06).abs() < 0.015 && sigma < 0.02, "{late} {sigma}");
        let belief = motion.at(32.3).unwrap();
        assert!((belief.direction.pan_deg - 10.0).abs() < 0.2, "{belief:?}");
        assert_eq!(belief.late_s, late);
    }

    #[test]
    fn what_is_assumed_of_the_delay_may_change() {
        let mut motion = walked(1.0, |t| 3.0 * t);
        let (before, (late, sigma)) = (motion.at(1.2).unwrap(), motion.late_s());
        motion.later(-0.3).unwrap();
        let after = motion.at(1.2).unwrap();
        assert_eq!((after.direction, after.speed_deg_s), (before.direction, before.speed_deg_s));
        assert!((motion.late_s().0 - (late - 0.3)).abs() < 1e-12 && (motion.late_s().1 - sigma).abs() < 1e-12);
        assert!(motion.later(f64::NAN).is_err() && (motion.late_s().0 - (late - 0.3)).abs() < 1e-12);
    }

    #[test]
    fn a_speed_that_is_not_significant_is_not_believed() {
        let motion = TargetMotion::new(MotionParams::default(), 0.0, &seen(3.0), (0.02, 0.05)).unwrap();
        let mut after_two = motion.clone();
        after_two.update(0.04, &seen(3.2)).unwrap();
        let speed = after_two.at(0.04).unwrap().speed_deg_s.pan_deg;
        assert!((0.3..4.0).contains(&speed), "0.2° in 40 ms with an error of 0.14°: {speed}");
        assert!((motion.late_s().0 - 0.02).abs() < 1e-12 && (motion.late_s().1 - 0.05).abs() < 1e-9);
    }
}
