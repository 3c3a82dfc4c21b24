//! The sum of template and pixel-wise learners, `staple` (bertinetto2016): a correlation filter on HOG, which knows the shape,
//! beside colour histograms, which do not mind deformation.

mod color;
mod params;

pub use color::ColorModel;
pub use params::StapleParams;

use crate::correlation::{
    Assembly, CorrelationTracker, HogFeatures, ResponseFilter, SearchSettings, Seen, Template, revive, start,
};
use crate::mosse::MosseFilter;
use crate::parameters::Parameters;
use crate::policy::ConfidenceThresholds;
use crate::scale::ScaleSettings;
use crate::{Result, TrackerRecipe};
use pursuit_geometry::{BBox, Size};
use pursuit_imaging::Frame;
use pursuit_vision::hog::HogLayout;
use serde::{Deserialize, Serialize};

/// Template and colours together: `(1 − α) f_tmpl + α f_hist` (bertinetto2016, eq. 2).
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct StapleFilter {
    template: MosseFilter,
    colors: ColorModel,
    cell_px: usize,
    color_share: f32,
    color_rate: f32,
}

impl ResponseFilter for StapleFilter {
    fn respond(&mut self, seen: Seen<'_>, response: &mut [f32]) {
        self.template.respond(seen, response);
        if let Some(patch) = seen.patch {
            response.iter_mut().for_each(|v| *v *= 1.0 - self.color_share);
            self.colors.add_response(patch, self.cell_px, seen.features.size(), self.color_share, response);
        }
    }

    fn learn(&mut self, seen: Seen<'_>, rate: f64) {
        self.template.learn(seen, rate);
        if let Some(patch) = seen.patch {
            self.colors.learn(patch, if rate >= 1.0 { 1.0 } else { self.color_rate });
        }
    }

    fn revive(&mut self, grid: Size, channels: usize) -> Result<(), String> {
        if !self.colors.is_consistent() || self.cell_px == 0 {
            return Err("its colour histograms do not have the right size".into());
        }
        self.template.revive(grid, channels)
    }
}

/// What a Staple tracker is made of.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StapleAssembly {
    params: StapleParams,
    settings: SearchSettings,
}

impl Assembly for StapleAssembly {
    type Features = HogFeatures;
    type Filter = StapleFilter;

    fn template(&self, bbox: &BBox) -> Template {
        let p = &self.params;
        Template::new(bbox, p.padding, p.cell_px, p.smallest_area_px, p.largest_area_px)
    }

    fn features(&self) -> HogFeatures {
        HogFeatures::new(HogLayout::Felzenszwalb31, self.params.cell_px, true)
    }

    fn filter(&self, template: &Template, grid: Size) -> StapleFilter {
        let p = &self.params;
        let (width, height) = template.target_in_patch();
        let label_sigma = p.label_sigma * (width * height).sqrt() / p.cell_px as f64;
        StapleFilter {
            template: MosseFilter::new(p.lambda, label_sigma, grid),
            colors: ColorModel::new((width, height), p.inner_margin),
            cell_px: p.cell_px,
            color_share: p.color_share as f32,
            color_rate: p.color_learning_rate as f32,
        }
    }

    fn scale_filter(&self) -> Option<ScaleSettings> {
        let p = &self.params;
        (p.scales > 1).then_some(ScaleSettings {
            scales: p.scales,
            interpolated: 2 * p.scales - 1,
            step: p.scale_step,
            label_sigma: p.scale_label_sigma,
            learning_rate: p.scale_learning_rate,
            lambda: p.scale_lambda,
            area_px: p.scale_area_px,
            cell_px: p.cell_px,
        })
    }

    fn settings(&self) -> &SearchSettings {
        &self.settings
    }
}

/// A Staple tracker.
pub type StapleTracker = CorrelationTracker<StapleAssembly>;

impl TrackerRecipe for StapleParams {
    type Tracker = StapleTracker;

    const SUMMARY: &'static str = "HOG correlation beside colour histograms: bears deformation, fast";
    const PAPER: &'static str = "staple";

    fn start(&self, frame: &Frame, bbox: BBox) -> Result<StapleTracker> {
        let settings = SearchSettings {
            scale_factors: vec![1.0],
            scale_penalty: 1.0,
            scale_gain: 1.0,
            learning_rate: self.learning_rate,
            wide_windows: 8,
            first_samples: 1,
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
        let assembly = StapleAssembly { params: self.clone(), settings };
        start(Self::OWNER, assembly, self.acceleration, thresholds, frame, bbox)
    }

    fn revive(&self, saved: StapleTracker) -> Result<StapleTracker> {
        revive(Self::OWNER, saved)
    }
}
