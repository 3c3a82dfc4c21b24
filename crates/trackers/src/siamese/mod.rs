//! Siamese network trackers: the localizer that all share, and those whose network is the user's: `siamese`, described by a TOML file, and `fear-xs`, which is known. In
//! the one loop, with state, calibrated score and re-detection. See `docs/guide/networks.md`.

mod localizer;
mod params;

pub use localizer::{ScoreWeights, SiameseLocalizer, SiameseModel};
pub use params::{Layout, SiameseParams};

use pursuit_inference::InferenceError;
use pursuit_inference::siamese::SiameseConfig;
use pursuit_tracking::motion::MotionParams;
use pursuit_tracking::policy::PolicyParams;
use pursuit_tracking::search::SearchParams;
use pursuit_tracking::{GroupParams, Result, TrackerRecipe, TrackingError};

/// `policy.calibrated.lost_below` of trackers that judge by their features too: what is in doubt has often only turned, and is no reason to look
/// elsewhere yet.
pub(crate) const DOUBT_STAYS: f64 = 0.1;

/// Released Siamese trackers look where the target was, and so do ours.
pub(crate) fn recipe<P>(name: &'static str, localizer: P) -> TrackerRecipe<P> {
    let groups = GroupParams {
        motion: MotionParams::calm(),
        policy: PolicyParams {
            occluded_below: 0.6,
            seen_from: 0.7,
            found_from: 0.85,
            occluded_score: 1.0,
            ..PolicyParams::default()
        },
        search: SearchParams { reach: 4.0, wide_windows: 3, ..SearchParams::at_last_place() },
    };
    TrackerRecipe { name, localizer, groups }
}

/// A network that is built in and its configuration, or the tracker's error.
pub(crate) fn built_in<N>(
    tracker: &str,
    network: Result<N, InferenceError>,
    config: Result<SiameseConfig, InferenceError>,
) -> Result<(N, SiameseConfig)> {
    network.and_then(|network| Ok((network, config?))).map_err(|e| TrackingError::Computation {
        tracker: tracker.to_owned(),
        index: 0,
        source: Box::new(e),
    })
}

/// `siamese`.
pub fn siamese(name: &'static str) -> TrackerRecipe<SiameseParams> {
    recipe(name, SiameseParams::default())
}

/// `fear-xs`.
pub fn fear_xs(name: &'static str) -> TrackerRecipe<SiameseParams> {
    // The score was fitted on 50 sequences: docs/papers/siamese.md.
    let fitted = SiameseParams { score_bias: -1.26, score_weight: 0.55, ..SiameseParams::default() };
    recipe(name, SiameseParams { layout: Layout::FearXs, ..fitted })
}
