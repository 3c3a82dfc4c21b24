//! What a correlation localizer is made of, as a value.

use super::filters::FilterKind;
use super::params::{ColorParams, PeakParams, ScaleFilterParams, ScaleLadderParams, ScoreParams, WindowParams};
use crate::features::{FeatureKind, FeatureSet};
use pursuit_parameters::Parameters;
use serde::{Deserialize, Serialize};

/// What a correlation localizer is made of: a value, saved with the tracker.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CorrelationSpec {
    /// The window.
    pub window: WindowParams,
    /// The features.
    pub features: FeatureKind,
    /// The filter on them.
    pub filter: FilterKind,
    /// Standard deviation of the label.
    pub label: Label,
    /// Share of the new appearance in the filter, per update.
    pub learning_rate: f64,
    /// First samples: the target as it is, and turned and resized a little (bolme2010, section 3.3).
    pub first_samples: FirstSamples,
    /// Sizes tried.
    pub ladder: ScaleLadderParams,
    /// The filter along scale, where there is one.
    pub scale: Option<ScaleFilterParams>,
    /// How responses are read.
    pub peaks: PeakParams,
    /// Colours, where they are looked at.
    pub color: Option<ColorParams>,
    /// How evidence becomes a probability.
    pub score: ScoreParams,
}

/// Standard deviation of the wanted response.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Label {
    /// As a share of √(width · height) of the target.
    OfTarget(f64),
    /// In cells.
    Cells(f64),
}

/// The samples a filter starts on.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FirstSamples {
    /// How many; at least 1.
    pub count: usize,
    /// Largest turn of one, in radians.
    pub turn_rad: f64,
    /// Largest change of size of one.
    pub resize: f64,
}

impl Default for FirstSamples {
    /// The target as it is.
    fn default() -> Self {
        Self { count: 1, turn_rad: 0.0, resize: 0.0 }
    }
}

impl CorrelationSpec {
    /// `filter` on `features` and nothing beside it: one size, no colours, a single first sample.
    pub fn new(features: FeatureKind, filter: FilterKind) -> Self {
        Self {
            window: WindowParams::default(),
            features,
            filter,
            label: Label::OfTarget(1.0 / 16.0),
            learning_rate: 0.0,
            first_samples: FirstSamples::default(),
            ladder: ScaleLadderParams::default(),
            scale: None,
            peaks: PeakParams::default(),
            color: None,
            score: ScoreParams::default(),
        }
    }

    /// Its features.
    pub(super) fn make_features(&self) -> FeatureSet {
        self.features.make(self.window.cell_px)
    }

    /// The standard deviation of the label in cells, for a target of `target` cells (width, height).
    pub(super) fn label_sigma(&self, target: (f64, f64)) -> f64 {
        match self.label {
            Label::Cells(sigma) => sigma,
            Label::OfTarget(share) => share * (target.0 * target.1).sqrt(),
        }
    }

    /// Whether its groups are within their ranges: for states read from outside.
    pub(super) fn is_sensible(&self) -> bool {
        self.window.check_all().is_ok()
            && self.ladder.check_all().is_ok()
            && self.scale.as_ref().is_none_or(|s| s.check_all().is_ok())
            && self.peaks.check_all().is_ok()
            && self.color.as_ref().is_none_or(|c| c.check_all().is_ok())
            && self.score.check_all().is_ok()
            && (0.0..=1.0).contains(&self.learning_rate)
    }
}

/// The cells of a target of `(width, height)` patch pixels.
pub(super) fn in_cells((width, height): (f64, f64), cell_px: usize) -> (f64, f64) {
    (width / cell_px as f64, height / cell_px as f64)
}
