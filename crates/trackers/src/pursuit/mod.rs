//! The default tracker, `pursuit`: two witnesses, a correlation filter that learns and a network that does not, and one judge
//! over what both say. `pursuit-light` is the filter alone. See `docs/papers/pursuit.md`.

mod judge;
mod light;
mod localizer;
mod seat;

pub use judge::{JudgeParams, Testimony};
pub use light::{FilterParams, light};
pub use localizer::WitnessLocalizer;

use crate::correlation::CorrelationLocalizer;
use crate::nanotrack::NanoTrackParams;
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_tracking::motion::MotionParams;
use pursuit_tracking::policy::PolicyParams;
use pursuit_tracking::search::SearchParams;
use pursuit_tracking::{GroupParams, LocalizerRecipe, Result, TrackerRecipe};

pursuit_tracking::parameters! {
    /// How the two witnesses are brought together.
    pub struct TogetherParams {
        /// Boxes that overlap by this much are of one thing.
        pub agree_from: f64 = 0.4, in 0.0..=1.0, source "ours";
        /// Of witnesses that agree, the network's share in the place.
        pub network_center: f64 = 0.5, in 0.0..=1.0, source "ours";
        /// Of witnesses that agree, the network's share in the size.
        pub network_size: f64 = 0.5, in 0.0..=1.0, source "ours";
        /// Share of a frame in a witness's standing.
        pub standing_rate: f64 = 0.15, in 0.0..=1.0, source "ours";
        /// How much a witness's standing counts beside what speaks for it now, where they disagree.
        pub standing: f64 = 1.0, in 0.0.., source "ours";
        /// A witness whose standing is lower than the other's by this much is put where the other is.
        pub reseat_margin: f64 = 2.0, in 0.0.., unit "log odds", source "ours";
        /// Where only the network is believed, the filter learns from this probability.
        pub teach_from: f64 = 0.9, in 0.0..=1.0, source "ours";
    }
}

pursuit_tracking::parameters! {
    /// Parameters of the default tracker.
    pub struct PursuitParams {
        /// The witness that learns: a correlation filter.
        pub filter: FilterParams = FilterParams::default();
        /// The witness that does not: a network.
        pub network: NanoTrackParams = NanoTrackParams::default();
        /// How they are brought together.
        pub together: TogetherParams = TogetherParams::default();
        /// The judge.
        pub judge: JudgeParams = JudgeParams::default();
    }
}

impl LocalizerRecipe for PursuitParams {
    type Localizer = WitnessLocalizer;

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<WitnessLocalizer> {
        let filter: CorrelationLocalizer = self.filter.localizer(frame, bbox)?;
        let network = self.network.localizer(frame, bbox)?;
        Ok(WitnessLocalizer::new(self.together.clone(), self.judge.clone(), filter, network, &bbox))
    }
}

/// `pursuit`.
pub fn pursuit(name: &'static str) -> TrackerRecipe<PursuitParams> {
    let groups = GroupParams {
        motion: MotionParams { acceleration: 30.0, ..MotionParams::default() },
        policy: PolicyParams {
            occluded_below: 0.5,
            seen_from: 0.6,
            found_from: 0.7,
            learn_from: 0.5,
            lost_below: 0.2,
            occluded_score: 1.0,
            ..PolicyParams::default()
        },
        search: SearchParams {
            prediction_gain: 0.0,
            reach: 5.0,
            wide_windows: 3,
            side_windows: 0,
            keep_inside: true,
            ..SearchParams::default()
        },
    };
    TrackerRecipe { name, localizer: PursuitParams::default(), groups }
}
