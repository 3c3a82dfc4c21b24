//! Constant velocity, replaced by a regression of the last velocities while the target manoeuvres (gao2007).

use super::center::{CenterModel, Start, Step};
use super::paper::Scaled;
use pursuit_estimation::Result;
use pursuit_estimation::gao2007::{AccelerationNoise, GatedParams};
use pursuit_estimation::point::{GatedPoint, PointFilter as _};

pursuit_parameters::choices! {
    /// How the acceleration that disturbs the motion goes on within a frame.
    pub enum HeldOrWhite {
        /// It is constant over a frame, as printed: where measurements are believed nearly as they are the velocity then swings.
        Held = "held",
        /// It is white.
        White = "white",
    }
}

pursuit_parameters::parameters! {
    /// The motion model `gao2007`.
    pub struct Gao2007Params {
        /// Normalised innovation squared that tells of a manoeuvre.
        pub surprise: f64 = 9.21, in above(0.0), source "99 % of χ² with 2 degrees of freedom";
        /// How the acceleration that disturbs the motion goes on within a frame.
        pub noise: HeldOrWhite = HeldOrWhite::White, source "ours; gao2007: held";
        /// The regression counts only while it predicts better than the filter without it: the share of a new squared error in the means
        /// that are compared. 0: it counts whenever the innovations are too large.
        pub guard: f64 = 0.2, in 0.0..=1.0, source "ours; gao2007: 0";
        /// The frame interval that the paper counts in.
        pub frame_s: f64 = 0.033, in above(0.0), unit "s", source "ours";
    }
}

impl CenterModel for Gao2007Params {
    type Belief = Scaled<GatedPoint>;

    fn start(&self, start: &Start) -> Result<Scaled<GatedPoint>> {
        Scaled::new(start, start.extent_px, |s| {
            let (noise, acceleration) = match self.noise {
                HeldOrWhite::White => (AccelerationNoise::White, start.noise.acceleration),
                // White acceleration of density q has, held over a step, the variance q / dt.
                HeldOrWhite::Held => (AccelerationNoise::Held, start.noise.acceleration / self.frame_s),
            };
            let settings = GatedParams {
                threshold: self.surprise,
                guard: self.guard,
                noise,
                ..GatedParams::recommended(acceleration, s.variance)
            };
            GatedPoint::new(settings, s.point, &s.at, &s.noise)
        })
    }

    fn advance(&self, belief: &mut Scaled<GatedPoint>, step: &Step) -> Result<()> {
        belief.filter.predict(step.dt_s)
    }
}
