//! The group `[motion]`.

use super::camera::CameraCompensation;

crate::choices! {
    /// How the target's motion is modelled.
    pub enum MotionModel {
        /// The velocity stays, disturbed by white acceleration.
        ConstantVelocity = "constant-velocity",
        /// The acceleration stays, disturbed by white jerk.
        ConstantAcceleration = "constant-acceleration",
        /// Circles at a turn rate that is estimated (extended filter).
        CoordinatedTurn = "coordinated-turn",
        /// Acceleration that forgets (Singer 1970).
        Singer = "singer",
        /// Acceleration that forgets, about the one estimated now (Zhou and Kumar 1984).
        CurrentStatistical = "current-statistical",
        /// Quiet, agile and turning motion, interacting (Blom and Bar-Shalom 1988).
        Imm = "imm",
        /// Constant velocity, replaced by a regression of the last velocities while the target manoeuvres (gao2007).
        Gao2007 = "gao2007",
        /// Constant velocity that goes over an interval again in which the target manoeuvred (zhu2014).
        Zhu2014 = "zhu2014",
        /// Constant velocity, put right by the acceleration that explains the last innovations (Chan, Hu and Plant 1979).
        InputEstimation = "input-estimation",
        /// Steady motion, flight and bounces, interacting; completes targets that are partly hidden.
        Bounce = "bounce",
        /// The filter of `ball` as printed: fixed noise in pixels at every step.
        Ball = "ball",
        /// Constant acceleration on positions taken every 200 ms, fixed noise in pixels, as printed in qu2010.
        Qu2010 = "qu2010",
        /// The same without noise: extrapolation from the last samples (qu2010, section 5).
        Qu2010Simplified = "qu2010-simplified",
        /// No motion: the target is expected where it was seen last.
        None = "none",
    }
}

crate::choices! {
    /// How `zhu2014` goes over an interval again in which the target manoeuvred (its equation (6)).
    pub enum HalfIntervalReading {
        /// The velocity jumped at an unknown instant, uniform over the interval.
        Anywhere = "anywhere",
        /// As printed: in the second half the target moves with the velocity observed.
        Literal = "literal",
    }
}

crate::parameters! {
    /// How the target's motion is modelled. Lengths are in target sizes (square root of the area), times in seconds, so that
    /// the same values suit near and distant targets and any frame rate.
    pub struct MotionParams {
        /// The model.
        pub model: MotionModel = MotionModel::ConstantVelocity, source "ours";
        /// How the camera's motion is found and taken out before the target's is predicted.
        pub camera: CameraCompensation = CameraCompensation::None, source "ours";
        /// How suddenly the target moves: spectral density of its white acceleration. Of `imm` that of its agile mode.
        pub acceleration: f64 = 100.0, in above(0.0), unit "sizes²/s³", source "ours";
        /// Of `constant-acceleration`: spectral density of the white jerk.
        pub jerk: f64 = 2500.0, in above(0.0), unit "sizes²/s⁵", source "ours";
        /// Of `singer`, `current-statistical`: how long a manoeuvre lasts (1/α).
        pub manoeuvre_s: f64 = 0.5, in above(0.0), unit "s", source "ours";
        /// Of `singer`, `current-statistical`: the largest acceleration of an axis.
        pub largest_acceleration: f64 = 20.0, in above(0.0), unit "sizes/s²", source "ours";
        /// Of `coordinated-turn`: growth of the turn rate's variance.
        pub turn_change: f64 = 4.0, in above(0.0), unit "rad²/s³", source "ours";
        /// Of `imm`: turn rate of its two turning modes, left and right.
        pub turn_rate: f64 = 2.0, in above(0.0), unit "rad/s", source "ours";
        /// Of `imm`: the quiet mode's acceleration as a share of the agile one's.
        pub quiet_share: f64 = 0.01, in above(0.0).at_most(1.0), source "ours";
        /// Of `imm`: mean time in a mode.
        pub sojourn_s: f64 = 1.0, in above(0.0), unit "s", source "ours";
        /// Of `gao2007`, `zhu2014`, `input-estimation`: normalised innovation squared that tells of a manoeuvre.
        pub surprise: f64 = 9.21, in above(0.0), source "zhu2014, 99 % of χ² with 2 degrees of freedom";
        /// Of `zhu2014`: what is done about a manoeuvre.
        pub half_interval: HalfIntervalReading = HalfIntervalReading::Anywhere, source "zhu2014, equation (6)";
        /// Of `gao2007`, `zhu2014`: the frame interval that their papers count in.
        pub frame_s: f64 = 0.033, in above(0.0), unit "s", source "ours";
        /// Growth of the size's standard deviation.
        pub size_change: f64 = 0.3, in 0.0.., unit "sizes/√s", source "ours";
        /// Standard deviation of the velocity at the start.
        pub start_speed: f64 = 5.0, in above(0.0), unit "sizes/s", source "ours";
        /// Standard deviation of a measured centre, where the localizer says none of its own. Correlation finds the centre to a
        /// fraction of a cell: what is measured is believed nearly as it is, and the model's part is the velocity.
        pub position_noise: f64 = 0.003, in 0.0.., unit "sizes", source "ours";
        /// Standard deviation of a measured width and height.
        pub size_noise: f64 = 0.003, in 0.0.., unit "sizes", source "ours";
        /// Added to both in quadrature: pixels are not finer than this.
        pub noise_floor_px: f64 = 0.05, in above(0.0), unit "px", source "ours";
        /// Of `bounce`.
        pub bounce: BounceParams = BounceParams::default();
        /// Of `qu2010`, `qu2010-simplified`.
        pub sampling: SamplingParams = SamplingParams::default();
    }
}

crate::parameters! {
    /// The three modes of the motion model `bounce`.
    pub struct BounceParams {
        /// *Steady*: spectral density of the white acceleration.
        pub steady_acceleration: f64 = 0.01, in 0.0.., unit "sizes²/s³", source "ours";
        /// *Flight*: spectral density of the white jerk.
        pub flight_jerk: f64 = 2500.0, in 0.0.., unit "sizes²/s⁵", source "ours";
        /// Standard deviation of the acceleration when a flight begins.
        pub flight_acceleration: f64 = 100.0, in above(0.0), unit "sizes/s²", source "ours";
        /// *Jump*: standard deviation of the change of velocity, added to `jump_of_speed` times the speed.
        pub jump_speed: f64 = 3.0, in above(0.0), unit "sizes/s", source "ours";
        /// *Jump*: standard deviation of the change of velocity as a share of the speed (a bounce turns it round).
        pub jump_of_speed: f64 = 1.0, in 0.0.., source "ours";
        /// Mean time between jumps.
        pub between_jumps_s: f64 = 1.0, in above(0.0), unit "s", source "ours";
        /// Mean duration of steady motion and of flight.
        pub sojourn_s: f64 = 1.5, in above(0.0), unit "s", source "ours";
        /// Probability that flight, not steady motion, follows a jump.
        pub flight_after_jump: f64 = 0.7, in 0.0..=1.0, source "ours";
        /// Probability of flight at the start.
        pub flight_at_start: f64 = 0.4, in 0.0..=0.5, source "ours";
        /// Probability of a jump at the start.
        pub jump_at_start: f64 = 0.1, in 0.0..=0.5, source "ours";
        /// A side shorter than this share of the expected one may be cut by what hides the target.
        pub cut_below: f64 = 0.85, in 0.0..=1.0, source "ours";
        /// Sides that shrink in step, to within this ratio, mean a smaller (more distant) target, not a cut one.
        pub in_step: f64 = 0.8, in 0.0..=1.0, source "ours";
    }
}

crate::parameters! {
    /// The predictor of qu2010.
    pub struct SamplingParams {
        /// Time between samples. 0: every frame is one.
        pub sample_s: f64 = 0.2, in 0.0..=60.0, unit "s", source "qu2010, section 4: 200 ms";
        /// q of `Q = q I`, added at each sample.
        pub process_variance: f64 = 0.3, in 0.0.., source "qu2010, section 4";
        /// r of `R = r I`.
        pub measurement_variance_px2: f64 = 2.0, in above(0.0), unit "px²", source "qu2010, section 4";
        /// Of `qu2010-simplified`: extrapolate from three samples (follows acceleration, triples the noise), not from two.
        pub three_points: bool = false, source "qu2010, section 5; Table 1 agrees with two";
    }
}

impl MotionParams {
    /// For balls: thrown, rolled, bounced and carried.
    pub fn ball() -> Self {
        Self {
            model: MotionModel::Bounce,
            size_change: 0.1,
            start_speed: 10.0,
            position_noise: 0.008,
            size_noise: 0.02,
            noise_floor_px: 0.2,
            ..Self::default()
        }
    }
}
