//! `meanshift`: kernel-based object tracking (comaniciu2003). The target is a histogram of colours weighed by a kernel; the box
//! climbs to where the histogram under the kernel is most alike, by the Bhattacharyya coefficient.

mod localizer;

pub use localizer::{MeanShift, MeanShiftFinding};

use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_tracking::motion::MotionParams;
use pursuit_tracking::policy::PolicyParams;
use pursuit_tracking::search::SearchParams;
use pursuit_tracking::{GroupParams, LocalizerRecipe, Result, TrackerRecipe};

pursuit_parameters::choices! {
    /// What the colours of the surroundings are used for.
    pub enum Surroundings {
        /// Nothing.
        None = "none",
        /// Target and candidates count less what the surroundings have too, as printed: the weights of the shift remain the same (ning2012).
        Paper = "paper",
        /// The target alone does (ning2012).
        Corrected = "corrected",
    }
}

pursuit_parameters::parameters! {
    /// Parameters of mean shift.
    pub struct MeanShiftParams {
        /// Bins of each of red, green and blue.
        pub bins: usize = 16, in 2..=32, source "comaniciu2003, section 5: 16 × 16 × 16";
        /// What the colours of the surroundings are used for.
        pub surroundings: Surroundings = Surroundings::Corrected, source "ning2012";
        /// The area of target and surroundings together.
        pub surroundings_area: f64 = 4.0, in above(1.0).at_most(100.0), unit "target areas", source "comaniciu2003, section 6.1: surroundings three times as large as the target";
        /// Most steps of a climb.
        pub most_steps: usize = 20, in 1..=1000, source "comaniciu2003, section 4.2: 20";
        /// A climb ends with a step shorter than this.
        pub least_step_px: f64 = 0.1, in above(0.0), unit "px", source "comaniciu2003, section 4.2: both ends in one pixel";
        /// How the size is found.
        pub size: KernelSizeParams = KernelSizeParams::default();
        /// Share of the colours of a frame in the target's.
        pub learning_rate: f64 = 0.0, in 0.0..=1.0, source "comaniciu2003: the first frame's for good";
        /// Share of the surroundings of a frame in those remembered.
        pub surroundings_rate: f64 = 0.0, in 0.0..=1.0, source "ours";
        /// About so many pixels are looked at under a kernel that has more.
        pub most_pixels: usize = 4096, in 64..=1_000_000, unit "px", source "ours";
        /// The score, fitted as `docs/papers/comaniciu2003.md` says.
        pub score: MeanShiftScoreParams = MeanShiftScoreParams::default();
    }
}

pursuit_parameters::choices! {
    /// By what the best of three kernels, one as large as before, one larger, one smaller, is known.
    pub enum SizeModel {
        /// By the coefficient that is climbed.
        Paper = "paper",
        /// By how much more alike the box is to the target than what is around it.
        Contrast = "contrast",
        /// The size stays.
        Fixed = "fixed",
    }
}

/// The models that try other sizes.
const TRIED: [SizeModel; 2] = [SizeModel::Paper, SizeModel::Contrast];

pursuit_parameters::parameters! {
    /// How the size is found.
    pub struct KernelSizeParams {
        /// By what the best kernel is known.
        pub model: SizeModel = SizeModel::Contrast, source "ours";
        /// How much larger and smaller kernels are tried.
        pub step: f64 = 0.1, in above(0.0).at_most(0.5), source "comaniciu2003, section 4.3: 0.1", of TRIED;
        /// Share of the best size in the new one, γ.
        pub rate: f64 = 0.1, in 0.0..=1.0, source "comaniciu2003, section 4.3: 0.1", of TRIED;
    }
}

pursuit_parameters::parameters! {
    /// ln of p / (1 − p) of the probability p that the box is right.
    pub struct MeanShiftScoreParams {
        /// With nothing seen.
        pub bias: f64 = -4.5, in -50.0..=50.0, source "ours";
        /// For the similarity.
        pub similarity: f64 = 9.4, in 0.0..=100.0, source "ours";
        /// For the similarity of what is around the box.
        pub around: f64 = -5.5, in -100.0..=100.0, source "ours";
    }
}

impl LocalizerRecipe for MeanShiftParams {
    type Localizer = MeanShift;

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<MeanShift> {
        Ok(MeanShift::new(self, frame, bbox))
    }
}

/// `meanshift`.
pub fn meanshift(name: &'static str) -> TrackerRecipe<MeanShiftParams> {
    let groups = GroupParams {
        motion: MotionParams::sudden(),
        policy: PolicyParams::patient(),
        search: SearchParams::default(),
    };
    TrackerRecipe { name, localizer: MeanShiftParams::default(), groups }
}
