//! The default tracker, `pursuit`: two witnesses, a correlation filter that learns and a network that does not, and one judge
//! over what both say. `pursuit-light` is the filter alone. See `docs/papers/pursuit.md`.

mod hearing;
mod judge;
mod light;
mod localizer;
mod meaning;
mod rivalry;
mod seat;

pub use judge::{JudgeParams, Testimony};
pub use light::{FilterParams, light};
pub use localizer::WitnessLocalizer;
pub use rivalry::RivalryParams;

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
        /// Boxes that overlap by this much are as good as each other: below, down to `agree_from`, the network's counts for more.
        pub same_from: f64 = 0.7, in 0.0..=1.0, source "ours";
        /// Of boxes as good as each other, the network's share in the place.
        pub network_center: f64 = 0.65, in 0.0..=1.0, source "ours";
        /// Of boxes as good as each other, the network's share in the size.
        pub network_size: f64 = 0.75, in 0.0..=1.0, source "ours";
        /// A filter that agrees this much goes its own way: it looks and learns where it saw the target itself.
        pub own_from: f64 = 0.6, in 0.0..=1.0, source "ours";
        /// Share of the difference between the first box and the network's there that the places of later ones are put right by.
        pub meant_center: f64 = 0.25, in 0.0..=1.0, source "ours";
        /// The same for the sizes.
        pub meant_size: f64 = 0.6, in 0.0..=1.0, source "ours";
        /// Where only the network is believed, the filter learns from this probability.
        pub teach_from: f64 = 0.9, in 0.0..=1.0, source "ours";
    }
    ordered { agree_from <= same_from }
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
        /// Whom to follow where they disagree.
        pub rivalry: RivalryParams = RivalryParams::default();
        /// The judge.
        pub judge: JudgeParams = JudgeParams::default();
    }
}

impl LocalizerRecipe for PursuitParams {
    type Localizer = WitnessLocalizer;

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<WitnessLocalizer> {
        let filter: CorrelationLocalizer = self.filter.localizer(frame, bbox)?;
        let network = self.network.localizer(frame, bbox)?;
        WitnessLocalizer::new(self.clone(), filter, network, frame, bbox)
    }
}

/// `pursuit`.
pub fn pursuit(name: &'static str) -> TrackerRecipe<PursuitParams> {
    let groups = GroupParams {
        motion: MotionParams { acceleration: 30.0, ..MotionParams::default() },
        policy: PolicyParams {
            occluded_below: 0.64,
            seen_from: 0.8,
            found_from: 0.85,
            learn_from: 0.8,
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
