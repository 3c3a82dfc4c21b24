//! Constants of the experiments of `gao2007`. The paper prints neither speeds, nor radius, nor noise, nor a filter's
//! parameter; what stands here is the independent reference's, which fitted the velocities of experiment 1 and the
//! setup of experiments 2 and 3 to the paper's plain figures.

use crate::trajectories::Path;

/// One target and how it is measured.
#[derive(Debug, Clone)]
pub(super) struct Bench {
    pub name: &'static str,
    pub path: Path,
    /// Deviation of the measurement noise, px.
    pub sigma: f64,
    /// `R` that the filters are given, px².
    pub variance: f64,
}

/// Frames of every bench, at `T = 1`.
const FRAMES: usize = 100;
/// Frame at which a straight target turns.
const TURN_AT: usize = 50;

impl Bench {
    /// Experiment 1: straight on, then suddenly the other way.
    pub fn experiment_1() -> Self {
        Self::turn("experiment 1: 2.25 to −1.65 px a frame, σ .5", 2.25, -1.65)
    }

    pub fn turn(name: &'static str, before: f64, after: f64) -> Self {
        Self { name, path: Path::turn(FRAMES, before, after, TURN_AT), sigma: 0.5, variance: 0.25 }
    }

    /// Experiments 2 (no noise) and 3, setup B. Its phase is not known to more than two digits, and without noise the
    /// adaptive figure depends on it (see the table).
    pub fn setup_b(name: &'static str, sigma: f64, phase: f64) -> Self {
        Self { name, path: Path::circle(FRAMES, 50.0, 99.39, phase), sigma, variance: 1.0 }
    }

    pub fn circle(name: &'static str, sigma: f64, variance: f64) -> Self {
        Self { name, path: Path::circle(FRAMES, 50.0, 100.0, 0.3), sigma, variance }
    }

    pub fn straight(name: &'static str) -> Self {
        Self { name, path: Path::turn(FRAMES, 2.0, 2.0, TURN_AT), sigma: 0.5, variance: 0.25 }
    }
}

/// The paper's figures (§5).
pub(super) struct Printed;

impl Printed {
    /// Root mean square error of the plain and the improved filter, experiments 1 to 3.
    pub const PLAIN: [f64; 3] = [6.830_544_895_772_68, 0.283_562_787_178_34, 0.356_643_207_964_02];
    pub const IMPROVED: [f64; 3] = [0.402_840_971_215_27, 0.079_365_405_215_87, 0.234_945_950_978_65];

    pub const fn ratio(experiment: usize) -> f64 {
        Self::IMPROVED[experiment - 1] / Self::PLAIN[experiment - 1]
    }
}

/// `q / R` of experiment 1's plain filter.
pub(super) const Q_OVER_R_1: f64 = 1e-4;
/// `q / R` of setup B.
pub(super) const Q_OVER_R_B: f64 = 0.01165;
/// Phase of setup B, rad.
pub(super) const PHASE_B: f64 = 1.05;
/// Noise of experiment 3, setup B, px.
pub(super) const SIGMA_B: f64 = 0.82;
/// Phases over which the noise-free figure of setup B is spread out.
pub(super) const PHASES: u32 = 100;
/// `q / R` tried for the tuned plain filter: from, to, per decade.
pub(super) const TUNING: (f64, f64, u32) = (1e-5, 1e3, 4);
/// Seeds that it is tuned on, apart from the table's.
pub(super) const TUNING_SEEDS: u32 = 100;
/// Chances that the quiet and the agile one of two interacting models stay for another step. The reference does not give
/// its own; of those tried these agree with its four figures (turn, two circles, straight on).
pub(super) const STAY: [f64; 2] = [0.97, 0.8];
/// The same for constant velocity and constant acceleration.
pub(super) const STAY_ACCELERATION: [f64; 2] = [0.95, 0.9];
