//! Quiet, agile and turning motion, interacting (Blom and Bar-Shalom 1988).

use super::center::{CenterBelief, CenterModel, Start, Step, parts};
use crate::Velocity;
use nalgebra::{Matrix2, SMatrix, SVector};
use pursuit_estimation::motion::{ConstantVelocity, KnownTurn};
use pursuit_estimation::{Gaussian, Imm, LinearMeasurement, MotionModel as _, Result, Switching, Transition};
use pursuit_geometry::Point;

/// Modes: quiet, agile, turning clockwise, turning counter-clockwise.
const MODES: usize = 4;

pursuit_parameters::parameters! {
    /// The motion model `imm`.
    pub struct ImmParams {
        /// Turn rate of the two turning modes, left and right.
        pub turn_rate: f64 = 2.0, in above(0.0), unit "rad/s", source "ours";
        /// The quiet mode's acceleration as a share of the agile one's.
        pub quiet_share: f64 = 0.01, in above(0.0).at_most(1.0), source "ours";
        /// Mean time in a mode.
        pub sojourn_s: f64 = 1.0, in above(0.0), unit "s", source "ours";
    }
}

impl CenterModel for ImmParams {
    /// About `[x, y, vx, vy]`.
    type Belief = Imm<4, MODES>;

    fn start(&self, start: &Start) -> Result<Imm<4, MODES>> {
        let (position, velocity) = (start.position_variance, start.velocity_variance());
        let belief = Gaussian::from_variances(
            SVector::from([start.at.x, start.at.y, 0.0, 0.0]),
            SVector::from([position, position, velocity, velocity]),
        )?;
        Imm::new(belief, [1.0 / MODES as f64; MODES])
    }

    fn advance(&self, belief: &mut Imm<4, MODES>, step: &Step) -> Result<()> {
        let (density, dt_s) = (step.acceleration_density(), step.dt_s);
        let turn =
            |rate_rad_per_s| KnownTurn { rate_rad_per_s, acceleration_density: density * self.quiet_share }.over(dt_s);
        let transitions: [Transition<4>; MODES] = [
            ConstantVelocity::<2>::white(density * self.quiet_share).over(dt_s)?,
            ConstantVelocity::<2>::white(density).over(dt_s)?,
            turn(self.turn_rate)?,
            turn(-self.turn_rate)?,
        ];
        belief.predict(&transitions, &switching(self.sojourn_s, dt_s)?)
    }
}

/// Every mode lasts `sojourn_s` on average and gives way to any other alike.
fn switching(sojourn_s: f64, dt_s: f64) -> Result<Switching<MODES>> {
    let leave = -(-dt_s / sojourn_s).exp_m1();
    let to = leave / (MODES - 1) as f64;
    Switching::per_step(SMatrix::from_fn(|i, j| if i == j { 1.0 - leave } else { to }))
}

impl CenterBelief for Imm<4, MODES> {
    fn correct(&mut self, at: Point, variance: f64) -> Result<()> {
        let sensor = LinearMeasurement::<2, 4>::select([0, 1], [variance, variance])?;
        self.update(&sensor, &SVector::from([at.x, at.y])).map(drop)
    }

    fn state(&self) -> (Point, Matrix2<f64>, Velocity) {
        parts(&self.combined())
    }
}
