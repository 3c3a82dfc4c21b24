//! `camshift`: continuously adaptive mean shift (bradski1998). A histogram of the target's hues turns every pixel into a
//! probability; a window climbs to the mean of the probabilities under it, and its size follows their sum.

mod back_projection;
mod localizer;
mod moments;

pub use localizer::{CamShift, CamShiftFinding};
pub use moments::{Moments, Spread};

use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_tracking::motion::MotionParams;
use pursuit_tracking::policy::PolicyParams;
use pursuit_tracking::search::SearchParams;
use pursuit_tracking::{GroupParams, LocalizerRecipe, Result, TrackerRecipe};

pursuit_parameters::choices! {
    /// What the probability of a hue is.
    pub enum Projection {
        /// Its share in the target, relative to that of the most frequent hue.
        Paper = "paper",
        /// Its share in the target, relative to that in target and surroundings.
        Surroundings = "surroundings",
        /// How much more of the target it is than of the surroundings: their difference relative to their sum, where that is above nought.
        Excess = "excess",
    }
}

pursuit_parameters::choices! {
    /// How the size follows the zeroth moment M₀₀, the sum of the probabilities.
    pub enum SizeModel {
        /// The window's mean side is 2 √M₀₀, and the box is the window.
        Paper = "paper",
        /// The box's area goes with M₀₀, as it was in the first frame.
        Calibrated = "calibrated",
        /// It does not.
        Fixed = "fixed",
    }
}

pursuit_parameters::parameters! {
    /// Parameters of continuously adaptive mean shift.
    pub struct CamShiftParams {
        /// Bins of hue.
        pub bins: usize = 16, in 2..=180, source "ours";
        /// Pixels less saturated have no hue.
        pub least_saturation: u8 = 30, in 0..=255, source "bradski1998: low saturation is ignored";
        /// Darker pixels have no hue.
        pub least_value: u8 = 10, in 0..=255, source "bradski1998: low brightness is ignored";
        /// Brighter pixels have no hue.
        pub greatest_value: u8 = 255, in 0..=255, source "bradski1998: a limit for white";
        /// Where fewer of the target's pixels have a hue, its brightness is looked at.
        pub least_hued: f64 = 0.2, in 0.0..=1.0, source "ours";
        /// What the probability of a hue is.
        pub projection: Projection = Projection::Excess, source "ours";
        /// The area of target and surroundings together.
        pub surroundings_area: f64 = 4.0, in above(1.0).at_most(100.0), unit "target areas", source "ours";
        /// How the size is measured.
        pub size: SizeParams = SizeParams::default();
        /// Most steps of the window.
        pub most_steps: usize = 15, in 1..=1000, source "ours";
        /// The window stands with a step shorter than this.
        pub least_step_px: f64 = 0.5, in above(0.0), unit "px", source "ours";
        /// Share of the hues of a frame in the target's.
        pub learning_rate: f64 = 0.0, in 0.0..=1.0, source "bradski1998: those of the start for good";
        /// About so many pixels are looked at in a window that has more.
        pub most_pixels: usize = 8192, in 64..=1_000_000, unit "px", source "ours";
        /// The score, fitted as `docs/papers/bradski1998.md` says.
        pub score: CamShiftScoreParams = CamShiftScoreParams::default();
    }
}

pursuit_parameters::parameters! {
    /// How the size is measured.
    pub struct SizeParams {
        /// How it follows the zeroth moment.
        pub model: SizeModel = SizeModel::Calibrated, source "ours";
        /// Share of the size measured in the new one.
        pub rate: f64 = 0.1, in 0.0..=1.0, source "ours; bradski1998: 1", of [SizeModel::Paper, SizeModel::Calibrated];
        /// Side of the window.
        pub window: f64 = 1.5, in 1.0..=10.0, unit "box sides", source "ours", of [SizeModel::Calibrated, SizeModel::Fixed];
    }
}

pursuit_parameters::parameters! {
    /// ln of p / (1 − p) of the probability p that the box is right.
    pub struct CamShiftScoreParams {
        /// With nothing seen.
        pub bias: f64 = -13.4, in -50.0..=50.0, source "ours";
        /// For the similarity.
        pub similarity: f64 = 20.6, in 0.0..=100.0, source "ours";
        /// For the similarity of what is around the box.
        pub around: f64 = -8.2, in -100.0..=100.0, source "ours";
    }
}

impl LocalizerRecipe for CamShiftParams {
    type Localizer = CamShift;

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<CamShift> {
        Ok(CamShift::new(self, frame, bbox))
    }
}

/// `camshift`.
pub fn camshift(name: &'static str) -> TrackerRecipe<CamShiftParams> {
    let groups = GroupParams {
        motion: MotionParams::sudden(),
        policy: PolicyParams::patient(),
        search: SearchParams::default(),
    };
    TrackerRecipe { name, localizer: CamShiftParams::default(), groups }
}
