//! Tracking by classification: a classifier that goes on learning tells windows with the target from windows beside it, and the window that
//! it rates best is where the target is. `boosting` (grabner2006), `mil` (babenko2011), `online-forest` (saffari2009), `struck`
//! (hare2011) and `dlssvm` (ning2016) differ in the classifier alone.

mod boosting;
mod canvas;
mod dlssvm;
mod forest;
mod gaussian;
mod haar;
mod localizer;
mod mil;
mod sigmoids;
mod struck;
#[cfg(test)]
mod twins;

pub use boosting::{BoostingParams, boosting};
pub use dlssvm::{DlssvmParams, dlssvm};
pub use forest::{ForestParams, online_forest};
pub use localizer::{ClassifierFinding, ClassifierLocalizer};
pub use mil::{MilParams, mil};
pub use struck::{StruckParams, struck};

use canvas::{Canvas, LANES, Place, Shape};
use pursuit_imaging::Frame;
use pursuit_tracking::motion::MotionParams;
use pursuit_tracking::policy::PolicyParams;
use pursuit_tracking::search::SearchParams;
use pursuit_tracking::{GroupParams, TrackerRecipe};
use serde::{Deserialize, Serialize};

pursuit_parameters::parameters! {
    /// How the target is looked at: sampled to one size, on a canvas with its surroundings.
    pub struct ViewParams {
        /// The target's area on the canvas.
        pub area_px: f64 = 1024.0, in 256.0..=4096.0, unit "canvas px", source "ours";
        /// Displacements that are looked at, to each side.
        pub reach: usize = 32, in 16..=64, unit "canvas px", source "ours: about one target size";
    }
}

pursuit_parameters::parameters! {
    /// ln of p / (1 − p) of the probability p that the box is right.
    pub struct ClassifierScoreParams {
        /// With nothing seen.
        pub bias: f64 = -2.0, in -50.0..=50.0, source "ours";
        /// For the classifier's rating of the box.
        pub rating: f64 = 2.0, in -100.0..=100.0, source "ours";
        /// For how much less it rates the best window that overlaps the box by less than half.
        pub margin: f64 = 2.0, in -100.0..=100.0, source "ours";
        /// For the likeness to the first frame.
        pub likeness: f64 = 4.0, in -100.0..=100.0, source "ours";
        /// For how alike its colours are to the first frame's.
        pub colors: f64 = 0.0, in -100.0..=100.0, source "ours";
    }
}

/// What tells the target from what is beside it.
trait Classifier {
    /// Prepares to rate windows of a canvas.
    fn look(&mut self, _canvas: &Canvas) {}

    /// Ratings of the windows from `at` to the right: the higher, the likelier the target.
    fn rate(&mut self, canvas: &Canvas, at: Place, out: &mut [f32; LANES]);

    /// Learns that the target is at `at`, and not elsewhere.
    fn learn(&mut self, shape: &Shape, canvas: &Canvas, at: Place);

    /// Whether a state that was read is one that learning leads to.
    fn is_sound(&self, shape: &Shape) -> bool;
}

/// A classifier of one of the kinds.
#[derive(Debug, Clone, Serialize, Deserialize)]
enum Model {
    Boosting(boosting::Boosting),
    Mil(mil::Mil),
    Forest(forest::Forest),
    Struck(struck::Struck),
    Dlssvm(Box<dlssvm::Dlssvm>),
}

impl Model {
    fn classifier(&mut self) -> &mut dyn Classifier {
        match self {
            Self::Boosting(it) => it,
            Self::Mil(it) => it,
            Self::Forest(it) => it,
            Self::Struck(it) => it,
            Self::Dlssvm(it) => &mut **it,
        }
    }

    /// A canvas of what it looks at.
    fn canvas(&self) -> Canvas {
        match self {
            Self::Dlssvm(it) if it.colored => Canvas::colored(),
            _ => Canvas::default(),
        }
    }

    /// One with the same parameters that has learnt nothing, for a target that is started on `frame`.
    fn untaught(&self, shape: &Shape, frame: &Frame) -> Self {
        match self {
            Self::Boosting(it) => Self::Boosting(boosting::Boosting::new(&it.params, shape)),
            Self::Mil(it) => Self::Mil(mil::Mil::new(&it.params, shape)),
            Self::Forest(it) => Self::Forest(forest::Forest::new(&it.params, shape)),
            Self::Struck(it) => Self::Struck(struck::Struck::new(&it.params, shape)),
            Self::Dlssvm(it) => Self::Dlssvm(Box::new(dlssvm::Dlssvm::new(&it.params, shape, frame.has_color()))),
        }
    }

    /// As it was before it was saved, where that is sound.
    fn restored(self, shape: &Shape) -> Option<Self> {
        match self {
            Self::Boosting(it) => it.is_sound(shape).then_some(Self::Boosting(it)),
            Self::Mil(it) => it.restored(shape).map(Self::Mil),
            Self::Forest(it) => it.is_sound(shape).then_some(Self::Forest(it)),
            Self::Struck(it) => it.restored(shape).map(Self::Struck),
            Self::Dlssvm(it) => it.restored(shape).map(|it| Self::Dlssvm(Box::new(it))),
        }
    }
}

/// These methods keep the size and follow jumps: the motion model smooths little. They bear a long doubt better than they find a target again.
fn recipe<P>(name: &'static str, localizer: P, policy: PolicyParams) -> TrackerRecipe<P> {
    let groups = GroupParams { motion: MotionParams::sudden(), policy, search: SearchParams::at_last_place() };
    TrackerRecipe { name, localizer, groups }
}
