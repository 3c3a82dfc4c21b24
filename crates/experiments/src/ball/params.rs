//! Constants of the `ball` experiment; the motions themselves are those of the scenes.

use pursuit_scenes::ball::BallMotion;

/// Frame intervals of the table: that of the simulated camera, and the reading of the paper that counts frames.
pub(super) const READINGS: [(&str, f64); 2] = [("dt = 1/30 s", 1.0 / 30.0), ("dt = 1", 1.0)];

/// The independent reference: prediction and estimate RMSE in px, mean and 5 % quantile of the prediction's overlap with
/// the detection, mean overlap of the estimate; for a motion and a reading.
pub(super) const fn reference(motion: BallMotion, reading: usize) -> [f64; 5] {
    match (motion, reading) {
        (BallMotion::Linear, 0) => [0.389, 0.301, 0.965, 0.936, 0.982],
        (BallMotion::Linear, _) => [0.938, 0.439, 0.942, 0.891, 0.990],
        (BallMotion::Rolling, 0) => [1.61, 0.791, 0.938, 0.873, 0.969],
        (BallMotion::Rolling, _) => [1.06, 0.439, 0.941, 0.888, 0.990],
        (BallMotion::Bouncing, 0) => [26.2, 12.2, 0.344, 0.0, 0.598],
        (BallMotion::Bouncing, _) => [11.1, 0.482, 0.746, 0.160, 0.987],
    }
}

/// Steady state of the printed filter for a frame interval: gain of position and velocity, prior variance of both (the
/// independent reference, ten digits).
pub(super) const STEADY: [(&str, f64, [f64; 4]); 5] = [
    ("dt = 1", 1.0, [0.982_108_297_0, 0.945_825_114_8, 5.489_182_887_9, 10.191_807_035_2]),
    ("dt = 1/25", 1.0 / 25.0, [0.560_331_175_7, 4.688_650_255_2, 0.127_443_917_9, 19.938_498_960_1]),
    ("dt = 1/30", 1.0 / 30.0, [0.532_306_561_9, 4.835_770_042_7, 0.113_815_272_7, 21.511_534_579_9]),
    ("dt = 1/60", 1.0 / 60.0, [0.439_982_425_2, 5.291_585_654_6, 0.078_565_824_5, 29.944_267_403_5]),
    ("dt = 1/120", 1.0 / 120.0, [0.372_459_998_7, 5.601_517_657_5, 0.059_352_391_5, 44.895_616_305_9]),
];

/// Spectral densities of the acceleration tried for the tuned plain filter, in extents²/s³: from, to, per decade.
pub(super) const TUNING: (f64, f64, u32) = (1e-4, 1e4, 2);
/// First seed that it is tuned on: apart from the table's.
pub(super) const TUNING_FROM: u64 = 1_000_000;
/// Seeds that it is tuned on.
pub(super) const TUNING_SEEDS: u32 = 40;
/// Start of the tuned plain filter: deviation of the speed, extents/s.
pub(super) const START_SPEED: f64 = 10.0;
/// Its growth of the size's deviation, extents per √s.
pub(super) const SIZE_CHANGE: f64 = 0.01;
