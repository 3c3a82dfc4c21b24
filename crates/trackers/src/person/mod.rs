//! `person`: who walks before a camera that stands still (qu2010). The default tracker's correlation finds the place; what
//! stands out of the background says how large the person is there, and whether anybody is there at all; the paper's
//! predictor says where the person will be at the next sample.

mod localizer;
mod sight;

pub use crate::backdrop::BackdropParams;
pub use localizer::PersonLocalizer;
pub use sight::PersonSight;

use crate::pursuit::FilterParams;
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_tracking::motion::{MotionModel, MotionParams};
use pursuit_tracking::{GroupParams, LocalizerRecipe, Result, TrackerRecipe};

pursuit_parameters::parameters! {
    /// Parameters of the person tracker.
    pub struct PersonParams {
        /// The background, and how much what stands out of it counts.
        pub backdrop: BackdropParams = BackdropParams::default();
        /// The correlation beside it: the default tracker's.
        pub appearance: FilterParams = FilterParams::default();
    }
}

impl LocalizerRecipe for PersonParams {
    type Localizer = PersonSight;

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<PersonSight> {
        PersonSight::new(frame, &bbox, |frame, bbox| PersonLocalizer::new(self, frame, bbox))
    }
}

/// `person`. `motion.model = "qu2010-simplified"` predicts without noise, `motion.qu2010.sample_s = 0` at every frame.
pub fn person(name: &'static str) -> TrackerRecipe<PersonParams> {
    let usual = crate::pursuit::light(name);
    let motion = MotionParams { model: MotionModel::Qu2010, ..usual.groups.motion };
    let groups = GroupParams { motion, ..usual.groups };
    TrackerRecipe { name, localizer: PersonParams::default(), groups }
}
