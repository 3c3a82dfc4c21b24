//! Constant velocity that goes over an interval again in which the target manoeuvred (zhu2014).

use super::center::{CenterModel, Start, Step};
use super::paper::Scaled;
use pursuit_estimation::point::{HalfIntervalPoint, PointFilter as _};
use pursuit_estimation::{Result, zhu2014};

pursuit_parameters::choices! {
    /// How `zhu2014` goes over an interval again in which the target manoeuvred (its equation (6)).
    pub enum HalfIntervalReading {
        /// The velocity jumped at an unknown instant, uniform over the interval.
        Anywhere = "anywhere",
        /// As printed: in the second half the target moves with the velocity observed.
        Literal = "literal",
    }
}

pursuit_parameters::parameters! {
    /// The motion model `zhu2014`.
    pub struct Zhu2014Params {
        /// Normalised innovation squared that tells of a manoeuvre.
        pub surprise: f64 = 9.21, in above(0.0), source "zhu2014, 99 % of χ² with 2 degrees of freedom";
        /// What is done about a manoeuvre.
        pub half_interval: HalfIntervalReading = HalfIntervalReading::Anywhere, source "zhu2014, equation (6)";
        /// The frame interval that the paper counts in.
        pub frame_s: f64 = 0.033, in above(0.0), unit "s", source "ours";
    }
}

impl CenterModel for Zhu2014Params {
    type Belief = Scaled<HalfIntervalPoint>;

    fn start(&self, start: &Start) -> Result<Scaled<HalfIntervalPoint>> {
        let reading = match self.half_interval {
            HalfIntervalReading::Anywhere => zhu2014::Zhu2014Params::jump_anywhere(),
            HalfIntervalReading::Literal => zhu2014::Zhu2014Params::literal(),
        };
        let settings = zhu2014::Zhu2014Params { threshold: self.surprise, ..reading };
        // The patent's noise is in pixels; that of other filters scales with the target.
        Scaled::new(start, 1.0, |s| HalfIntervalPoint::new(settings, self.frame_s, s.point, &s.at, &s.noise))
    }

    fn advance(&self, belief: &mut Scaled<HalfIntervalPoint>, step: &Step) -> Result<()> {
        belief.filter.predict(step.dt_s)
    }
}
