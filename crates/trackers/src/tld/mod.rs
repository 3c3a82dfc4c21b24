//! Tracking-learning-detection: `tld` (kalal2012) and `kalman-tld` (zhu2014). A follower of points and a cascade of detectors
//! look at every frame; what they agree on is learned. See `docs/papers/tld.md` and `docs/papers/zhu2014.md`.

mod cascade;
mod cells;
mod clusters;
mod ferns;
mod grid;
mod integrator;
mod learning;
mod localizer;
mod params;
mod trust;
#[cfg(test)]
mod twins;
mod view;
mod worker;

pub use localizer::TldLocalizer;
pub use params::{
    FernParams, GateBy, GuideParams, LearningParams, NeighborParams, RefineBy, RefineParams, ScanParams, TldParams,
    TldScoreParams,
};

use crate::flow::FlowParams;
use pursuit_tracking::motion::{MotionModel, MotionParams, Zhu2014Params};
use pursuit_tracking::policy::{CalibratedParams, PolicyParams};
use pursuit_tracking::search::{SearchModel, SearchParams, WideningParams};
use pursuit_tracking::{GroupParams, TrackerRecipe};

/// A target counts as seen from a conservative similarity of 0.55 on, as seen again from 0.6, and as found from 0.61.
fn policy() -> PolicyParams {
    PolicyParams {
        occluded_below: 0.70,
        seen_from: 0.78,
        found_from: 0.80,
        learn_from: 0.70,
        lost_after_s: 0.5,
        // What it learns of a trajectory that looks unlike the target is the point of the method; validity guards it.
        calibrated: CalibratedParams { learn_unsure_from: 0.30, lost_below: 0.02, ..CalibratedParams::default() },
        ..PolicyParams::default()
    }
}

/// `tld`: the whole frame is scanned at every frame.
pub fn tld(name: &'static str) -> TrackerRecipe<TldParams> {
    let groups = GroupParams {
        motion: MotionParams::calm(),
        policy: policy(),
        search: SearchParams { model: SearchModel::Everywhere, ..SearchParams::default() },
    };
    TrackerRecipe { name, localizer: TldParams::default(), groups }
}

/// `kalman-tld`: a Kalman filter of the centre (`Q = I`, `R = I`) steadies the box and says where to scan: within four times
/// the target's area while it is seen.
pub fn kalman_tld(name: &'static str) -> TrackerRecipe<TldParams> {
    let groups = GroupParams {
        motion: MotionParams {
            model: MotionModel::Zhu2014,
            position_noise: 0.0,
            noise_floor_px: 1.0,
            zhu2014: Zhu2014Params { surprise: 5.99, ..Zhu2014Params::default() },
            ..MotionParams::default()
        },
        policy: policy(),
        // What is followed in doubt is looked for near it: the bands see the rest.
        search: SearchParams {
            model: SearchModel::Widening,
            reach: 2.0,
            widening: WideningParams { growth_per_s: 1.0 },
            ..SearchParams::default()
        },
    };
    let flow = FlowParams { guided_levels: 1, ..FlowParams::eight_px() };
    let localizer = TldParams { flow, guide: GuideParams::default(), ..TldParams::default() };
    TrackerRecipe { name, localizer, groups }
}
