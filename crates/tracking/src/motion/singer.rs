//! Acceleration that forgets: Singer's model, and the current statistical one.

use super::center::{CenterModel, Start, Step};
use super::constant_acceleration::accelerating;
use pursuit_estimation::motion::{CurrentStatistical, Singer};
use pursuit_estimation::{Gaussian, MotionModel as _, Result};

pursuit_parameters::parameters! {
    /// The motion model `singer`.
    pub struct SingerParams {
        /// How long a manoeuvre lasts (1/α).
        pub manoeuvre_s: f64 = 0.5, in above(0.0), unit "s", source "ours";
        /// The largest acceleration of an axis.
        pub largest_acceleration: f64 = 20.0, in above(0.0), unit "sizes/s²", source "ours";
    }
}

pursuit_parameters::parameters! {
    /// The motion model `current-statistical`.
    pub struct CurrentStatisticalParams {
        /// How long a manoeuvre lasts (1/α).
        pub manoeuvre_s: f64 = 0.5, in above(0.0), unit "s", source "ours";
        /// The largest acceleration of an axis.
        pub largest_acceleration: f64 = 20.0, in above(0.0), unit "sizes/s²", source "ours";
    }
}

impl CenterModel for SingerParams {
    type Belief = Gaussian<6>;

    fn start(&self, start: &Start) -> Result<Gaussian<6>> {
        accelerating(start, self.largest_acceleration)
    }

    fn advance(&self, belief: &mut Gaussian<6>, step: &Step) -> Result<()> {
        // Singer's own prior with accelerations uniform up to the largest: σ² = a²/3.
        let largest = self.largest_acceleration * step.extent_px;
        let model = Singer::<2>::from_prior(1.0 / self.manoeuvre_s, largest, 0.0, 0.0);
        belief.predict(&model.over(step.dt_s)?)
    }
}

impl CenterModel for CurrentStatisticalParams {
    type Belief = Gaussian<6>;

    fn start(&self, start: &Start) -> Result<Gaussian<6>> {
        accelerating(start, self.largest_acceleration)
    }

    fn advance(&self, belief: &mut Gaussian<6>, step: &Step) -> Result<()> {
        let max_acceleration = self.largest_acceleration * step.extent_px;
        let model = CurrentStatistical::<2> { rate_per_s: 1.0 / self.manoeuvre_s, max_acceleration };
        let transition = model.over_from(belief.mean(), step.dt_s)?;
        belief.predict(&transition)
    }
}
