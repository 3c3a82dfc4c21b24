//! Constants of the filter part of `zhai2024`, and of the toy target that its particle filter is tried on.

use pursuit_estimation::zhai2024::{VarianceParams, VarianceRule};

/// Variance of the residuals that the recursion is tried on (standard deviation 2).
pub(super) const RESIDUAL_VARIANCE: f64 = 4.0;
/// Steps at which it is looked at, with the reference's mean of the printed form.
pub(super) const LOOKED_AT: [(usize, f64); 6] =
    [(2, 2.0), (5, 8.1), (10, 18.2), (50, 97.8), (100, 198.7), (1000, 1995.0)];

/// A square target that accelerates at random.
#[derive(Debug, Clone, Copy)]
pub(super) struct Toy {
    /// Frames.
    pub frames: usize,
    /// Side of the target, px.
    pub side_px: f64,
    /// Deviation of the first velocity on each axis, px a frame.
    pub start_speed: f64,
    /// Deviation of the acceleration on each axis, px a frame².
    pub acceleration: f64,
    /// `σ_w`, width of the likelihood, equation (27).
    pub sigma_w: f64,
}

impl Toy {
    /// The reference's: 80 frames, a target of 20 × 20 px, `σ_w` = .15.
    pub const fn new(acceleration: f64) -> Self {
        Self { frames: 80, side_px: 20.0, start_speed: 2.0, acceleration, sigma_w: 0.15 }
    }
}

/// Frames in sight that a filter has to have learned from before its re-detection is judged.
pub(super) const LEARNED_FRAMES: usize = 10;
/// How far from the target the windows on it are at most, in target sizes along each axis.
pub(super) const AGAIN_OFF: f64 = 0.3;
/// Windows on the background in each frame.
pub(super) const AGAIN_PLACES: usize = 4;

/// Deviation of the detector's error on each axis, px: about what a correlation filter leaves.
pub(super) const DETECTOR_PX: f64 = 1.0;

/// The position that the residuals of equation (24) are taken against; the paper calls it the actual state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PositionFrom {
    /// What a detector found (the paper's correlation filter), [`DETECTOR_PX`] off.
    Detector,
    /// The particles' own weighted mean: no detector.
    Mean,
}

/// What is tried, by name: smooth motion and strong manoeuvres with a detector, and smooth motion without one.
pub(super) const SETTINGS: [(&str, f64, PositionFrom); 3] = [
    ("acceleration .5 px a frame², with a detector", 0.5, PositionFrom::Detector),
    ("acceleration 2 px a frame², with a detector", 2.0, PositionFrom::Detector),
    ("acceleration .5 px a frame², without a detector", 0.5, PositionFrom::Mean),
];

/// Numbers of particles tried.
pub(super) const COUNTS: [usize; 5] = [10, 20, 50, 100, 500];
/// Deviation of the fixed motion noise, px.
pub(super) const FIXED_PX: f64 = 15.0;

/// How the particles' motion noise is chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Noise {
    Fixed,
    Learnt(VarianceRule),
}

/// The rules of the table, by name.
pub(super) const NOISES: [(&str, Noise); 5] = [
    ("fixed 15 px", Noise::Fixed),
    ("maximum likelihood", Noise::Learnt(VarianceRule::Corrected)),
    ("window of 10", Noise::Learnt(VarianceRule::Window { length: 10 })),
    ("exponential, .2", Noise::Learnt(VarianceRule::Exponential { weight: 0.2 })),
    ("as printed", Noise::Learnt(VarianceRule::Printed)),
];

/// The rule with a floor of one pixel; as printed it has no cap.
pub(super) fn bounded(rule: VarianceRule) -> VarianceParams {
    VarianceParams { floor: 1.0, ..VarianceParams::unbounded(rule) }
}

/// The reference's RMSE, px, of particles that keep their target, and the share of lost ones, for noise and count.
pub(super) fn reference(acceleration: f64, noise: &str, count: usize) -> (Option<f64>, Option<f64>) {
    let smooth = acceleration < 1.0;
    let column = COUNTS.iter().position(|c| *c == count).unwrap_or(0);
    let of = |values: [Option<f64>; 5]| values[column];
    let rmse = match (smooth, noise) {
        (true, "fixed 15 px") => of([None, Some(3.99), Some(1.93), Some(1.18), Some(0.44)]),
        (true, "maximum likelihood") => of([Some(1.47), Some(1.02), Some(0.84), Some(0.78), Some(0.74)]),
        (true, "window of 10") => of([Some(1.38), Some(1.03), Some(0.88), Some(0.83), Some(0.79)]),
        (true, "exponential, .2") => of([None, Some(1.02), Some(0.79), Some(0.71), Some(0.67)]),
        (true, _) => of([None, None, Some(0.79), Some(0.46), Some(0.24)]),
        (false, "fixed 15 px") => of([None, Some(4.02), None, Some(1.20), None]),
        (false, "maximum likelihood") => of([None, Some(2.02), None, Some(1.45), None]),
        (false, "window of 10") => of([None, Some(1.94), None, Some(1.44), None]),
        (false, "exponential, .2") => of([None, Some(1.65), None, Some(1.18), None]),
        (false, _) => of([None, None, None, Some(0.94), None]),
    };
    let lost = match (smooth, noise, count) {
        (true, "fixed 15 px", 10) => Some(0.49),
        (true, "exponential, .2", 10) => Some(0.03),
        (true, "as printed", 10) | (false, "as printed", 20) => Some(1.0),
        (true, "as printed", 20) => Some(0.71),
        (true, "maximum likelihood" | "window of 10", _) => Some(0.0),
        _ => None,
    };
    (rmse, lost)
}
