//! Constants of the experiment around `zhu2014`'s equation (6). The patent gives `Q = I₄` and `R = I₂` and no experiment
//! of the filter alone; the targets are the independent reference's.

use crate::trajectories::Turns;
use pursuit_estimation::zhu2014::{HalfInterval, Jump, Zhu2014Params};

/// One setting: how sharply the target turns, and the filter's `Q = q I₄`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Setting {
    pub name: &'static str,
    pub degrees: f64,
    pub process_variance: f64,
}

impl Setting {
    pub const ALL: [Self; 4] = [
        Self { name: "90° turns, Q = I", degrees: 90.0, process_variance: 1.0 },
        Self { name: "180° turns, Q = I", degrees: 180.0, process_variance: 1.0 },
        Self { name: "60° turns, Q = I", degrees: 60.0, process_variance: 1.0 },
        Self { name: "90° turns, Q = .1 I", degrees: 90.0, process_variance: 0.1 },
    ];

    /// Sixty frames at 10 px a frame with three turns at instants of their own within frames; far enough apart that the
    /// five frames after one belong to it alone.
    pub const fn turns(&self) -> Turns {
        Turns { frames: 60, speed: 10.0, count: 3, degrees: self.degrees, margin: 5.0, apart: 7.0 }
    }
}

/// Deviation of the measurement noise, px: the patent's `R = I₂`.
pub(super) const SIGMA_PX: f64 = 1.0;
/// Frames after a turn's own that count as following it.
pub(super) const AFTER: usize = 5;
/// 95 % and 99 % of χ² with two degrees of freedom.
pub(super) const THRESHOLDS: [f64; 2] = [5.99, 9.21];
/// A threshold that every measurement exceeds: the interval is halved always.
const ALWAYS: f64 = f64::MIN_POSITIVE;
/// Chances that the interacting models' quiet and jumping mode are followed by a jump.
pub(super) const JUMP_CHANCE: f64 = 0.05;
/// Deviation of the velocity jump in the interacting models, px a frame.
pub(super) const JUMP_DEVIATION: f64 = 5.0;
/// `q` tried for the tuned plain filter: from, to, per decade.
pub(super) const TUNING: (f64, f64, u32) = (1e-2, 1e4, 4);
/// Seeds that it is tuned on, apart from the table's.
pub(super) const TUNING_SEEDS: u32 = 100;
/// Samples drawn for the 95 % interval of a ratio.
pub(super) const BOOTSTRAP: usize = 1000;

/// Readings of equation (6), as figures name them, with the reference's ratio after a turn in each [`Setting`].
pub(super) fn variants(process_variance: f64) -> Vec<(&'static str, Zhu2014Params, [Option<f64>; 4])> {
    let params = |half_interval, threshold| Zhu2014Params {
        process_variance,
        measurement_variance_px2: SIGMA_PX * SIGMA_PX,
        threshold,
        half_interval,
    };
    let middle = HalfInterval::JumpAtMiddle { jump: Jump::fixed(10.0) };
    let all = |values: [f64; 4]| values.map(Some);
    vec![
        ("A(dt/2) A(dt/2), Q/2 each", params(HalfInterval::HalfNoise, ALWAYS), all([0.996, 0.996, 0.996, 1.001])),
        ("the same, Q each, as printed", params(HalfInterval::FullNoise, ALWAYS), all([0.888, 0.880, 0.902, 0.826])),
        (
            "literal: observed velocity, 9.21",
            params(HalfInterval::ObservedVelocity, THRESHOLDS[1]),
            all([0.715, 0.630, 0.851, 0.422]),
        ),
        ("jump at mid interval, 10 px, 9.21", params(middle, THRESHOLDS[1]), all([0.883, 0.749, 1.053, 0.518])),
        ("jump anywhere, 5.99", params(anywhere(), THRESHOLDS[0]), all([0.663, 0.597, 0.755, 0.364])),
        ("jump anywhere, 9.21", params(anywhere(), THRESHOLDS[1]), all([0.688, 0.616, 0.811, 0.374])),
    ]
}

/// The default reading: `max(5 px, half the speed)` at an instant uniform over the interval.
const fn anywhere() -> HalfInterval {
    HalfInterval::JumpAnywhere { jump: Jump::default_for(1.0) }
}
