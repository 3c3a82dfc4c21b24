//! Constant acceleration.

use super::center::{CenterModel, Start, Step};
use nalgebra::SVector;
use pursuit_estimation::motion::ConstantAcceleration;
use pursuit_estimation::{Gaussian, MotionModel as _, Result};

pursuit_parameters::parameters! {
    /// The motion model `constant-acceleration`.
    pub struct ConstantAccelerationParams {
        /// Spectral density of the white jerk.
        pub jerk: f64 = 2500.0, in above(0.0), unit "sizes²/s⁵", source "ours";
        /// Standard deviation of the acceleration at the start.
        pub start_acceleration: f64 = 20.0, in above(0.0), unit "sizes/s²", source "ours";
    }
}

impl CenterModel for ConstantAccelerationParams {
    type Belief = Gaussian<6>;

    fn start(&self, start: &Start) -> Result<Gaussian<6>> {
        accelerating(start, self.start_acceleration)
    }

    fn advance(&self, belief: &mut Gaussian<6>, step: &Step) -> Result<()> {
        let model = ConstantAcceleration::<2>::white(self.jerk * step.extent_px * step.extent_px);
        belief.predict(&model.over(step.dt_s)?)
    }
}

/// A belief about `[x, y, vx, vy, ax, ay]` at rest, whose acceleration has this standard deviation, sizes/s².
pub(super) fn accelerating(start: &Start, acceleration: f64) -> Result<Gaussian<6>> {
    let acceleration = (acceleration * start.extent_px).powi(2);
    let (position, velocity) = (start.position_variance, start.velocity_variance());
    Gaussian::from_variances(
        SVector::from([start.at.x, start.at.y, 0.0, 0.0, 0.0, 0.0]),
        SVector::from([position, position, velocity, velocity, acceleration, acceleration]),
    )
}
