//! The same filter with other values: fixed size, depth, grey values, as published.

use super::{KcfFeatures, KcfParams, groups};
use crate::correlation::{ScaleLadderParams, ScoreParams, WindowParams};
use pursuit_tracking::TrackerRecipe;
use pursuit_tracking::policy::PolicyParams;

impl KcfParams {
    /// The published tracker on HOG: fixed size, patch at full resolution up to a target of 100 × 100 pixels.
    pub fn henriques2015_hog() -> Self {
        Self {
            window: WindowParams {
                padding: 1.5,
                smallest_area_px: 256.0,
                largest_area_px: 62_500.0,
                ..WindowParams::default()
            },
            scale_ladder: ScaleLadderParams::default(),
            ..Self::default()
        }
    }

    /// The published tracker on grey values.
    pub fn henriques2015_gray() -> Self {
        Self {
            features: KcfFeatures::Gray,
            kernel_sigma: 0.2,
            kernel_power: 7.0,
            learning_rate: 0.075,
            ..Self::henriques2015_hog()
        }
    }

    /// On HOG, of fixed size.
    pub(crate) fn fixed() -> Self {
        Self {
            scale_ladder: ScaleLadderParams::default(),
            score: ScoreParams { bias: -1.8, psr: 0.17, collapse: 1.25, likeness: 7.1, ..ScoreParams::default() },
            ..Self::default()
        }
    }

    /// The circulant structure tracker (henriques2012): grey values, λ = 0.01, label of 1/16, on smaller patches.
    fn csk() -> Self {
        Self {
            lambda: 0.01,
            label_sigma: 0.0625,
            window: WindowParams {
                padding: 1.5,
                smallest_area_px: 1024.0,
                largest_area_px: 4096.0,
                ..WindowParams::default()
            },
            score: ScoreParams { bias: -1.9, psr: 0.05, collapse: 1.5, likeness: 3.6, ..ScoreParams::default() },
            ..Self::henriques2015_gray()
        }
    }
}

/// `kcf-fixed`: on HOG, of fixed size.
pub fn kcf_fixed(name: &'static str) -> TrackerRecipe<KcfParams> {
    let policy = PolicyParams {
        occluded_below: 0.3,
        seen_from: 0.6,
        found_from: 0.6,
        learn_from: 0.3,
        ..PolicyParams::default()
    };
    TrackerRecipe { name, localizer: KcfParams::fixed(), groups: groups(policy) }
}

/// `kcf-depth`: on HOG of depth, of fixed size; the baseline of zhai2024.
pub fn kcf_depth(name: &'static str) -> TrackerRecipe<KcfParams> {
    let localizer = KcfParams { features: KcfFeatures::DepthHog, ..KcfParams::fixed() };
    TrackerRecipe { localizer, ..kcf_fixed(name) }
}

/// `csk`: on grey values.
pub fn csk(name: &'static str) -> TrackerRecipe<KcfParams> {
    let policy = PolicyParams {
        occluded_below: 0.3,
        seen_from: 0.4,
        found_from: 0.4,
        learn_from: 0.3,
        lost_after_s: 2.0,
        ..PolicyParams::default()
    };
    TrackerRecipe { name, localizer: KcfParams::csk(), groups: groups(policy) }
}
