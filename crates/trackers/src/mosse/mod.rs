//! The filter of minimum output sum of squared error, `mosse` (bolme2010).

mod filter;
#[cfg(test)]
mod oracle;
mod params;

pub use filter::MosseFilter;
pub use params::MosseParams;

use crate::correlation::{
    Assembly, CorrelationLocalizer, Features, LogGrayFeatures, NearThenWide, SearchSettings, Template,
};
use crate::motion::BoxFilter;
use crate::policy::{ConfidencePolicy, ConfidenceThresholds};
use crate::{Result, SingleTarget, TrackerRecipe};
use pursuit_geometry::{BBox, Size};
use pursuit_imaging::Frame;
use serde::{Deserialize, Serialize};

/// What a MOSSE tracker is made of.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MosseAssembly {
    params: MosseParams,
    settings: SearchSettings,
}

impl Assembly for MosseAssembly {
    type Features = LogGrayFeatures;
    type Filter = MosseFilter;

    fn template(&self, bbox: &BBox) -> Template {
        let (cell_px, p) = (self.features().cell_px(), &self.params);
        Template::new(bbox, p.padding, cell_px, p.smallest_area_px, p.largest_area_px)
    }

    fn features(&self) -> LogGrayFeatures {
        LogGrayFeatures::default()
    }

    fn filter(&self, _template: &Template, grid: Size) -> MosseFilter {
        MosseFilter::new(self.params.epsilon, self.params.label_sigma_px, grid)
    }

    fn settings(&self) -> &SearchSettings {
        &self.settings
    }
}

/// A MOSSE tracker.
pub type MosseTracker = SingleTarget<NearThenWide, CorrelationLocalizer<MosseAssembly>, ConfidencePolicy, BoxFilter>;

impl TrackerRecipe for MosseParams {
    type Tracker = MosseTracker;

    const SUMMARY: &'static str = "minimum output sum of squared error on grey values: the fastest, keeps the size";
    const PAPER: &'static str = "mosse";

    fn start(&self, frame: &Frame, bbox: BBox) -> Result<MosseTracker> {
        let settings = SearchSettings {
            scale_factors: vec![1.0],
            scale_penalty: 1.0,
            scale_gain: 1.0,
            learning_rate: self.learning_rate,
            wide_windows: 8,
            first_samples: self.first_samples,
            calibration: Self::CALIBRATION,
        };
        let thresholds = ConfidenceThresholds {
            occluded_below: self.occluded_below,
            seen_from: self.seen_from,
            found_from: self.seen_from,
            learn_from: self.learn_from,
            lost_after_s: self.lost_after_s,
            ..ConfidenceThresholds::CAUTIOUS
        };
        let assembly = MosseAssembly { params: self.clone(), settings };
        crate::correlation::start("mosse", assembly, self.acceleration, thresholds, frame, bbox)
    }

    fn revive(&self, saved: MosseTracker) -> Result<MosseTracker> {
        crate::correlation::revive("mosse", saved)
    }
}
