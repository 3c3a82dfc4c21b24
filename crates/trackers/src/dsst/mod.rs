//! Discriminative scale space tracking: `dsst` (danelljan2014) and `fdsst` (danelljan2017). One filter finds the place, a
//! second one, along scale, the size; `fdsst` compresses the features of the first.

mod compression;
mod filter;
mod params;
#[cfg(test)]
mod twin;

pub use compression::{CHANNELS, Compression};
pub use filter::CompressedFilter;
pub use params::{DsstParams, FdsstParams};

use crate::correlation::{Assembly, CorrelationTracker, ResponseFilter, SearchSettings, Template, revive, start};
use crate::mosse::MosseFilter;
use crate::parameters::Parameters;
use crate::policy::ConfidenceThresholds;
use crate::regularised::AppearanceFeatures;
use crate::scale::ScaleSettings;
use crate::{Result, TrackerRecipe};
use params::Common;
use pursuit_geometry::{BBox, Size};
use pursuit_imaging::Frame;
use serde::{Deserialize, Serialize};

/// What a scale space tracker is made of: gradients and grey × a filter × a filter along scale.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ScaleSpaceAssembly<P> {
    common: Common,
    /// How the filter is made.
    kind: P,
    settings: SearchSettings,
}

/// Makes the translation filter of a scale space tracker.
pub trait Translation: Clone + Send {
    /// The filter.
    type Filter: ResponseFilter;

    /// An untaught filter for planes of `grid` cells with regularisation `lambda` and a label of `label_sigma` cells.
    fn filter(&self, lambda: f64, label_sigma: f64, grid: Size) -> Self::Filter;
}

/// All features as they are: the filter of MOSSE with several channels (danelljan2014, eqs. 3 to 5).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Uncompressed;

impl Translation for Uncompressed {
    type Filter = MosseFilter;

    fn filter(&self, lambda: f64, label_sigma: f64, grid: Size) -> MosseFilter {
        MosseFilter::new(lambda, label_sigma, grid)
    }
}

/// Features compressed to this many channels (danelljan2017, section 4.1).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Compressed(pub usize);

impl Translation for Compressed {
    type Filter = CompressedFilter;

    fn filter(&self, lambda: f64, label_sigma: f64, grid: Size) -> CompressedFilter {
        CompressedFilter::new(self.0, lambda, label_sigma, grid)
    }
}

impl<P: Translation> Assembly for ScaleSpaceAssembly<P> {
    type Features = AppearanceFeatures;
    type Filter = P::Filter;

    fn template(&self, bbox: &BBox) -> Template {
        let c = &self.common;
        Template::new(bbox, c.padding, c.cell_px, c.area_px.0, c.area_px.1)
    }

    fn features(&self) -> AppearanceFeatures {
        AppearanceFeatures::new(self.common.cell_px, false)
    }

    fn filter(&self, template: &Template, grid: Size) -> P::Filter {
        let (width, height) = template.target_in_patch();
        let label_sigma = self.common.label_sigma * (width * height).sqrt() / self.common.cell_px as f64;
        self.kind.filter(self.common.lambda, label_sigma, grid)
    }

    fn scale_filter(&self) -> Option<ScaleSettings> {
        Some(self.common.scale)
    }

    fn settings(&self) -> &SearchSettings {
        &self.settings
    }
}

/// Spectral density of the acceleration, sizes² per s³.
const ACCELERATION: f64 = 300.0;

/// The tracker `dsst`.
pub type DsstTracker = CorrelationTracker<ScaleSpaceAssembly<Uncompressed>>;
/// The tracker `fdsst`.
pub type FdsstTracker = CorrelationTracker<ScaleSpaceAssembly<Compressed>>;

fn start_as<P: Translation>(
    name: &'static str,
    common: Common,
    kind: P,
    frame: &Frame,
    bbox: BBox,
) -> Result<CorrelationTracker<ScaleSpaceAssembly<P>>> {
    let settings = SearchSettings {
        scale_factors: vec![1.0],
        scale_penalty: 1.0,
        scale_gain: 1.0,
        learning_rate: common.learning_rate,
        wide_windows: 8,
        first_samples: 1,
        calibration: params::CALIBRATION,
    };
    start(
        name,
        ScaleSpaceAssembly { common, kind, settings },
        ACCELERATION,
        ConfidenceThresholds::CAUTIOUS,
        frame,
        bbox,
    )
}

impl TrackerRecipe for DsstParams {
    type Tracker = DsstTracker;

    const SUMMARY: &'static str = "correlation on gradients beside a filter along scale: exact sizes, quick";
    const PAPER: &'static str = "dsst";

    fn start(&self, frame: &Frame, bbox: BBox) -> Result<DsstTracker> {
        start_as(Self::OWNER, self.common(), Uncompressed, frame, bbox)
    }

    fn revive(&self, saved: DsstTracker) -> Result<DsstTracker> {
        revive(Self::OWNER, saved)
    }
}

impl TrackerRecipe for FdsstParams {
    type Tracker = FdsstTracker;

    const SUMMARY: &'static str = "dsst on compressed features with half as many sizes, interpolated: quicker";
    const PAPER: &'static str = "dsst";

    fn start(&self, frame: &Frame, bbox: BBox) -> Result<FdsstTracker> {
        start_as(Self::OWNER, self.common(), Compressed(self.dimensions), frame, bbox)
    }

    fn revive(&self, saved: FdsstTracker) -> Result<FdsstTracker> {
        revive(Self::OWNER, saved)
    }
}
