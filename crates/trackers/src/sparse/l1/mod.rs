//! `l1`: robust tracking by ℓ₁ minimisation (mei2009, mei2011) in real time (bao2012). Samples of where the target may be are written as a
//! sum of few templates of it and of few single pixels, which stand for what covers it; the sample that the templates explain best is the
//! target.

mod apg;
mod localizer;
mod patches;
mod templates;

pub use localizer::{L1Finding, L1Tracker};

use crate::wary::wary;
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_tracking::motion::MotionParams;
use pursuit_tracking::policy::PolicyParams;
use pursuit_tracking::search::SearchParams;
use pursuit_tracking::{GroupParams, LocalizerRecipe, Result, TrackerRecipe};

pursuit_parameters::parameters! {
    /// Parameters of the ℓ₁ tracker.
    pub struct L1Params {
        /// Samples, N.
        pub samples: usize = 600, in 8..=10_000, source "bao2012, section 4: 600";
        /// Templates of the target, n.
        pub templates: usize = 10, in 2..=32, source "bao2012, section 4: 10";
        /// Pixels across a template.
        pub columns: usize = 12, in 4..=32, unit "px", source "bao2012, section 4: 12 × 15";
        /// Pixels down a template.
        pub rows: usize = 15, in 4..=32, unit "px", source "bao2012, section 4: 12 × 15";
        /// The minimisation.
        pub code: L1CodeParams = L1CodeParams::default();
        /// How samples move.
        pub moves: L1MoveParams = L1MoveParams::default();
        /// How templates change.
        pub update: L1UpdateParams = L1UpdateParams::default();
        /// The score, fitted as `docs/papers/bao2012.md` says.
        pub score: L1ScoreParams = L1ScoreParams::default();
    }
}

pursuit_parameters::parameters! {
    /// min ½ ‖y − T a − e‖² + λ Σ a + λᵢ ‖e‖₁ + μ/2 ‖e‖², a ≥ 0, where T are the templates, a and e their coefficients and those of the
    /// single pixels (bao2012, eq. 6).
    pub struct L1CodeParams {
        /// Weight λ of the templates' coefficients; patches have length one.
        pub lambda: f64 = 0.2, in 0.0..=10.0, source "bao2012, released settings: 0.2";
        /// Weight λᵢ of the pixels' coefficients.
        pub pixel_lambda: f64 = 0.03, in 0.0..=10.0, source "ours; bao2012, released settings: 0.001 and few iterations";
        /// Energy control μ of the pixels' coefficients while nothing covers the target; 0 while something does.
        pub mu: f64 = 10.0, in 0.0..=1000.0, source "bao2012, section 3.1, released settings: 10";
        /// Iterations of the accelerated proximal gradient.
        pub iterations: usize = 20, in 1..=500, source "ours";
        /// Sharpness α of the likelihood exp(−α ‖y − T a‖²).
        pub sharpness: f64 = 50.0, in above(0.0).at_most(1000.0), source "mei2011, eq. 11; released settings: 50";
        /// Whether samples are left out whose likelihood is too small to be drawn again whatever their code, as the error of least
        /// squares tells (mei2011, section 4).
        pub bounded: bool = true, source "mei2011, section 4: minimal error bound";
    }
}

pursuit_parameters::parameters! {
    /// The random walk of samples in one second; in a time t they go √t times as far.
    pub struct L1MoveParams {
        /// Of the place.
        pub place: f64 = 0.5, in 0.0..=100.0, unit "sizes/√s", source "ours";
        /// Of the size's logarithm.
        pub size: f64 = 0.08, in 0.0..=10.0, unit "1/√s", source "ours";
        /// Of the logarithm of the proportion of width to height.
        pub proportion: f64 = 0.02, in 0.0..=10.0, unit "1/√s", source "ours";
        /// Of the angle.
        pub turn: f64 = 0.08, in 0.0..=10.0, unit "rad/√s", source "ours";
        /// Of how far the top is moved against the bottom, in parts of the height.
        pub skew: f64 = 0.02, in 0.0..=10.0, unit "1/√s", source "ours";
        /// Least size that is believed, relative to that at the start.
        pub least_size: f64 = 0.2, in above(0.0).at_most(1.0), source "ours";
        /// Greatest size that is believed.
        pub most_size: f64 = 5.0, in 1.0..=100.0, source "ours";
    }
}

pursuit_parameters::parameters! {
    /// How templates change (mei2011, section 3.3), and what keeps them from it.
    pub struct L1UpdateParams {
        /// A new view whose angle to the template of greatest coefficient is larger takes the place of the template of least weight.
        pub angle_rad: f64 = 0.7, in 0.0..=3.2, unit "rad", source "bao2012, released settings: 40°";
        /// Greatest weight of a template.
        pub most_weight: f64 = 0.3, in above(0.0).at_most(1.0), source "mei2011, algorithm 1: 0.3";
        /// Pixels whose coefficient is above this, relative to the standard deviation of a patch, are covered.
        pub covered_above: f64 = 0.3, in above(0.0), unit "standard deviations", source "ours";
        /// The target is covered where the largest region of covered pixels has more than this share of all.
        pub covered_share: f64 = 0.3, in above(0.0).at_most(1.0), source "mei2011, section 5: 30 %";
        /// For so long after it was covered the templates stay and μ is 0.
        pub hold_frames: usize = 5, in 0..=1000, unit "frames", source "mei2011, section 5: 5";
    }
}

pursuit_parameters::parameters! {
    /// ln of p / (1 − p) of the probability p that the box is right.
    pub struct L1ScoreParams {
        /// With nothing seen.
        pub bias: f64 = -7.1, in -50.0..=50.0, source "ours";
        /// For the error ‖y − T a‖².
        pub error: f64 = 0.0, in -100.0..=100.0, source "ours";
        /// For the share of the largest region of covered pixels.
        pub covered: f64 = 0.0, in -100.0..=100.0, source "ours";
        /// For the likeness to the first frame.
        pub likeness: f64 = 4.8, in -100.0..=100.0, source "ours";
        /// For how alike its colours are to the first frame's.
        pub colors: f64 = 4.9, in -100.0..=100.0, source "ours";
    }
}

impl LocalizerRecipe for L1Params {
    type Localizer = L1Tracker;

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<L1Tracker> {
        L1Tracker::new(self, frame, bbox)
    }
}

/// `l1`.
pub fn l1(name: &'static str) -> TrackerRecipe<L1Params> {
    let groups = GroupParams {
        motion: MotionParams::sudden(),
        policy: wary(PolicyParams::patient()),
        search: SearchParams::default(),
    };
    TrackerRecipe { name, localizer: L1Params::default(), groups }
}
