//! Constant velocity, put right by the acceleration that explains the last innovations (Chan, Hu and Plant 1979).

use super::center::{CenterModel, Start, Step};
use super::paper::Scaled;
use pursuit_estimation::Result;
use pursuit_estimation::motion::ConstantVelocity;
use pursuit_estimation::point::{InputPoint, PointFilter as _};

pursuit_parameters::parameters! {
    /// The motion model `input-estimation`.
    pub struct InputEstimationParams {
        /// Normalised innovation squared that tells of a manoeuvre.
        pub surprise: f64 = 9.21, in above(0.0), source "99 % of χ² with 2 degrees of freedom";
    }
}

impl CenterModel for InputEstimationParams {
    type Belief = Scaled<InputPoint>;

    fn start(&self, start: &Start) -> Result<Scaled<InputPoint>> {
        Scaled::new(start, start.extent_px, |s| {
            let motion = ConstantVelocity::white(start.noise.acceleration);
            InputPoint::new(motion, self.surprise, s.point, &s.at, &s.noise)
        })
    }

    fn advance(&self, belief: &mut Scaled<InputPoint>, step: &Step) -> Result<()> {
        belief.filter.predict(step.dt_s)
    }
}
