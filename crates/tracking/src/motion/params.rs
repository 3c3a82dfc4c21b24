//! The group `[motion]`.

use super::bounce::BounceParams;
use super::camera::CameraCompensation;
use super::constant_acceleration::ConstantAccelerationParams;
use super::coordinated_turn::CoordinatedTurnParams;
use super::gao2007::Gao2007Params;
use super::imm::ImmParams;
use super::input_estimation::InputEstimationParams;
use super::per_frame::PerFrameParams;
use super::sampled::{ExtrapolationParams, SamplingParams};
use super::singer::{CurrentStatisticalParams, SingerParams};
use super::zhu2014::Zhu2014Params;

pursuit_parameters::choices! {
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
        /// The filters that association by overlap is published with: noise per frame (bewley2016, aharon2022).
        PerFrame = "per-frame",
        /// No motion: the target is expected where it was seen last.
        None = "none",
    }
}

pursuit_parameters::parameters! {
    /// How the target's motion is modelled. Lengths are in target sizes (square root of the area), times in seconds, so that
    /// the same values suit near and distant targets and any frame rate.
    pub struct MotionParams {
        /// The model.
        pub model: MotionModel = MotionModel::ConstantVelocity, source "ours";
        /// How the camera's motion is found and taken out before the target's is predicted.
        pub camera: CameraCompensation = CameraCompensation::None, source "ours";
        /// How suddenly the target moves: spectral density of its white acceleration; of `imm` that of its agile mode.
        pub acceleration: f64 = 100.0, in above(0.0), unit "sizes²/s³", source "ours", of ACCELERATED;
        /// Growth of the centre's standard deviation beside what its velocity brings about: walkers sway, detectors' boxes wander.
        pub wander: f64 = 0.0, in 0.0.., unit "sizes/√s", source "ours", of [MotionModel::ConstantVelocity];
        /// The acceleration of a target that manoeuvres: of one whose measured centre is farther than `agile_from` from the prediction. 0: that of others.
        pub agile: f64 = 0.0, in 0.0.., unit "sizes²/s³", source "Bar-Shalom, Li and Kirubarajan 2001, section 11.2.2", of [MotionModel::ConstantVelocity];
        /// Squared Mahalanobis distance of a measured centre beyond which a target manoeuvres.
        pub agile_from: f64 = 9.0, in above(0.0), source "ours", of [MotionModel::ConstantVelocity];
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
        /// Constant acceleration.
        pub constant_acceleration as "constant-acceleration": ConstantAccelerationParams =
            ConstantAccelerationParams::default(), of [MotionModel::ConstantAcceleration];
        /// Circles at an estimated turn rate.
        pub coordinated_turn as "coordinated-turn": CoordinatedTurnParams = CoordinatedTurnParams::default(),
            of [MotionModel::CoordinatedTurn];
        /// Acceleration that forgets.
        pub singer: SingerParams = SingerParams::default(), of [MotionModel::Singer];
        /// Acceleration that forgets, about the one estimated now.
        pub current_statistical as "current-statistical": CurrentStatisticalParams = CurrentStatisticalParams::default(),
            of [MotionModel::CurrentStatistical];
        /// Interacting quiet, agile and turning motion.
        pub imm: ImmParams = ImmParams::default(), of [MotionModel::Imm];
        /// The regression of gao2007.
        pub gao2007: Gao2007Params = Gao2007Params::default(), of [MotionModel::Gao2007];
        /// The half intervals of zhu2014.
        pub zhu2014: Zhu2014Params = Zhu2014Params::default(), of [MotionModel::Zhu2014];
        /// Input estimation.
        pub input_estimation as "input-estimation": InputEstimationParams = InputEstimationParams::default(),
            of [MotionModel::InputEstimation];
        /// Steady motion, flight and jumps.
        pub bounce: BounceParams = BounceParams::default(), of [MotionModel::Bounce];
        /// The samples of qu2010.
        pub qu2010: SamplingParams = SamplingParams::default(), of [MotionModel::Qu2010, MotionModel::Qu2010Simplified];
        /// The extrapolation of qu2010, section 5.
        pub qu2010_simplified as "qu2010-simplified": ExtrapolationParams = ExtrapolationParams::default(),
            of [MotionModel::Qu2010Simplified];
        /// With noise per frame.
        pub per_frame as "per-frame": PerFrameParams = PerFrameParams::default(), of [MotionModel::PerFrame];
    }
    renamed {
        "jerk" => ["constant-acceleration.jerk"],
        "manoeuvre_s" => ["singer.manoeuvre_s", "current-statistical.manoeuvre_s"],
        "largest_acceleration" => [
            "singer.largest_acceleration", "current-statistical.largest_acceleration",
            "constant-acceleration.start_acceleration"
        ],
        "turn_change" => ["coordinated-turn.turn_change"],
        "turn_rate" => ["imm.turn_rate", "coordinated-turn.start_turn_rate"],
        "quiet_share" => ["imm.quiet_share"],
        "sojourn_s" => ["imm.sojourn_s"],
        "surprise" => ["gao2007.surprise", "zhu2014.surprise", "input-estimation.surprise"],
        "half_interval" => ["zhu2014.half_interval"],
        "frame_s" => ["gao2007.frame_s", "zhu2014.frame_s"],
        "sampling.three_points" => ["qu2010-simplified.three_points"],
        "sampling" => ["qu2010"],
    }
}

/// The models that white acceleration drives.
const ACCELERATED: [MotionModel; 5] = [
    MotionModel::ConstantVelocity,
    MotionModel::CoordinatedTurn,
    MotionModel::Imm,
    MotionModel::Gao2007,
    MotionModel::InputEstimation,
];

impl MotionParams {
    /// Of correlation filters that are believed from frame to frame: the velocity follows what is measured within a few frames.
    /// Where the search starts at the last place (`search.prediction_gain = 0`), it moves nothing but what is predicted.
    pub fn sudden() -> Self {
        Self { acceleration: 300.0, ..Self::default() }
    }

    /// Of trackers that judge what they see by a network, by points or by a wide context: their velocity is steadied over more
    /// frames, and carries them through an occlusion.
    pub fn calm() -> Self {
        Self { acceleration: 30.0, ..Self::default() }
    }

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
