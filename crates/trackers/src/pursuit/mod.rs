//! The default tracker, `pursuit`: two witnesses, a correlation filter that learns and a network that does not, a second network that
//! sees better and is asked now and then, and judges over what they say. `pursuit-light` is the filter alone. See `docs/papers/pursuit.md`.

mod arbitration;
mod consult;
mod convention;
mod expert;
mod fusion;
mod judge;
mod light;
mod localizer;
mod offset;
mod params;
mod schedule;
mod usual;

pub use judge::{JointEvidence, JudgeParams};
pub use light::light;
pub use localizer::WitnessLocalizer;
pub use params::{
    ArbitrationParams, ExpertArbitrationParams, FilterParams, FusionParams, NetworksParams, PursuitParams,
};

use crate::correlation::CorrelationLocalizer;
use crate::nanotrack::NanoTrackLocalizer;
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_tracking::motion::MotionParams;
use pursuit_tracking::policy::{CalibratedParams, PolicyParams};
use pursuit_tracking::search::SearchParams;
use pursuit_tracking::{GroupParams, LocalizerRecipe, Result, TrackerRecipe};

impl LocalizerRecipe for PursuitParams {
    type Localizer = WitnessLocalizer;

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<WitnessLocalizer> {
        let filter: CorrelationLocalizer = self.filter.localizer(frame, bbox)?;
        let network = NanoTrackLocalizer::new(&self.network, frame, bbox)?;
        WitnessLocalizer::new(self.clone(), filter, network, frame, bbox)
    }
}

/// `pursuit`.
pub fn pursuit(name: &'static str) -> TrackerRecipe<PursuitParams> {
    let groups = GroupParams {
        motion: MotionParams::calm(),
        policy: PolicyParams {
            occluded_below: 0.66,
            seen_from: 0.85,
            found_from: 0.83,
            learn_from: 0.77,
            probation_s: 0.5,
            calibrated: CalibratedParams { lost_below: 0.2, ..CalibratedParams::default() },
            occluded_score: 1.0,
            ..PolicyParams::default()
        },
        search: SearchParams {
            reach: 5.0,
            wide_windows: 6,
            side_windows: 0,
            keep_inside: true,
            whole_size: true,
            tentative: 2,
            believe_at: 2.5,
            neutral: 0.6,
            news: 0.3,
            ..SearchParams::at_last_place()
        },
    };
    TrackerRecipe { name, localizer: PursuitParams::default(), groups }
}
