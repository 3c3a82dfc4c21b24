//! Circles at a turn rate that is estimated.

use super::center::{CenterModel, Start, Step};
use nalgebra::SVector;
use pursuit_estimation::motion::CoordinatedTurn;
use pursuit_estimation::{Gaussian, Result};

pursuit_parameters::parameters! {
    /// The motion model `coordinated-turn`.
    pub struct CoordinatedTurnParams {
        /// Growth of the turn rate's variance.
        pub turn_change: f64 = 4.0, in above(0.0), unit "rad²/s³", source "ours";
        /// Standard deviation of the turn rate at the start.
        pub start_turn_rate: f64 = 2.0, in above(0.0), unit "rad/s", source "ours";
    }
}

impl CenterModel for CoordinatedTurnParams {
    /// About `[x, y, vx, vy, ω]`.
    type Belief = Gaussian<5>;

    fn start(&self, start: &Start) -> Result<Gaussian<5>> {
        let (position, velocity) = (start.position_variance, start.velocity_variance());
        Gaussian::from_variances(
            SVector::from([start.at.x, start.at.y, 0.0, 0.0, 0.0]),
            SVector::from([position, position, velocity, velocity, self.start_turn_rate.powi(2)]),
        )
    }

    fn advance(&self, belief: &mut Gaussian<5>, step: &Step) -> Result<()> {
        let model =
            CoordinatedTurn { acceleration_density: step.acceleration_density(), turn_density: self.turn_change };
        belief.predict_extended(&model, step.dt_s)
    }
}
