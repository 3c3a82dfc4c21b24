use super::params::{CskParams, KcfFeatureKind, KcfFixedParams, KcfParams, KernelKind};
use super::{Kernel, KernelFilter};
use crate::correlation::{
    Assembly, CorrelationTracker, Features, GrayFeatures, HogFeatures, SearchSettings, Template, revive, start,
};
use crate::parameters::Parameters;
use crate::policy::ConfidenceThresholds;
use crate::{Result, TrackerRecipe};
use pursuit_geometry::{BBox, Size};
use pursuit_imaging::Frame;
use pursuit_vision::hog::HogLayout;
use pursuit_vision::sampling::{Planes, Window};
use serde::{Deserialize, Serialize};

/// Which features a kernelized correlation filter works on.
#[derive(Debug, Clone)]
pub enum KcfFeatures {
    /// Grey values.
    Gray(GrayFeatures),
    /// Histograms of oriented gradients.
    Hog(Box<HogFeatures>),
}

impl Features for KcfFeatures {
    fn channels(&self) -> usize {
        match self {
            Self::Gray(f) => f.channels(),
            Self::Hog(f) => f.channels(),
        }
    }

    fn cell_px(&self) -> usize {
        match self {
            Self::Gray(f) => f.cell_px(),
            Self::Hog(f) => f.cell_px(),
        }
    }

    fn extract(&mut self, frame: &Frame, window: &Window, out: &mut Planes) {
        match self {
            Self::Gray(f) => f.extract(frame, window, out),
            Self::Hog(f) => f.extract(frame, window, out),
        }
    }
}

/// What a kernelized correlation tracker is made of.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct KcfAssembly {
    /// Surroundings of the target as a multiple of its size.
    pub padding: f64,
    /// HOG cells of this size; `None` for grey values.
    pub hog_cell_px: Option<usize>,
    /// Bounds of the patch's area in pixels.
    pub area_px: (f64, f64),
    /// The kernel.
    pub kernel: Kernel,
    /// Regularisation λ.
    pub lambda: f64,
    /// Standard deviation of the label as a share of √(width · height) of the target.
    pub label_sigma: f64,
    /// How to search and learn.
    pub settings: SearchSettings,
}

impl Assembly for KcfAssembly {
    type Features = KcfFeatures;
    type Filter = KernelFilter;

    fn template(&self, bbox: &BBox) -> Template {
        Template::new(bbox, self.padding, self.hog_cell_px.unwrap_or(1), self.area_px.0, self.area_px.1)
    }

    fn features(&self) -> KcfFeatures {
        match self.hog_cell_px {
            Some(cell_px) => KcfFeatures::Hog(Box::new(HogFeatures::new(HogLayout::Felzenszwalb31, cell_px, false))),
            None => KcfFeatures::Gray(GrayFeatures::default()),
        }
    }

    fn filter(&self, template: &Template, grid: Size) -> KernelFilter {
        let (width, height) = template.target_in_patch();
        let cells = (width * height).sqrt() / self.hog_cell_px.unwrap_or(1) as f64;
        KernelFilter::new(self.kernel, self.lambda, self.label_sigma * cells, grid)
    }

    fn settings(&self) -> &SearchSettings {
        &self.settings
    }
}

/// A kernelized correlation tracker.
pub type KcfTracker = CorrelationTracker<KcfAssembly>;

impl KcfParams {
    fn assembly(&self) -> KcfAssembly {
        KcfAssembly {
            padding: self.padding,
            hog_cell_px: (self.features == KcfFeatureKind::Hog).then_some(self.cell_px),
            area_px: (self.smallest_area_px, self.largest_area_px),
            kernel: match self.kernel {
                KernelKind::Linear => Kernel::Linear,
                KernelKind::Polynomial => Kernel::Polynomial { offset: self.kernel_offset, power: self.kernel_power },
                KernelKind::Gaussian => Kernel::Gaussian { sigma: self.kernel_sigma },
            },
            lambda: self.lambda,
            label_sigma: self.label_sigma,
            settings: SearchSettings {
                scale_factors: SearchSettings::scale_ladder(self.scale_step, self.scale_levels),
                scale_penalty: self.scale_penalty,
                scale_gain: 1.0,
                learning_rate: self.learning_rate,
                wide_windows: 6,
                first_samples: 1,
                calibration: self.calibration(),
            },
        }
    }

    fn start_as(&self, name: &'static str, frame: &Frame, bbox: BBox) -> Result<KcfTracker> {
        let thresholds = ConfidenceThresholds {
            occluded_below: self.occluded_below,
            seen_from: self.seen_from,
            found_from: self.seen_from,
            learn_from: self.learn_from,
            lost_after_s: self.lost_after_s,
            ..ConfidenceThresholds::CAUTIOUS
        };
        start(name, self.assembly(), self.acceleration, thresholds, frame, bbox)
    }
}

impl TrackerRecipe for KcfParams {
    type Tracker = KcfTracker;

    const SUMMARY: &'static str = "kernelized correlation filter on HOG with a search over sizes: very fast";
    const PAPER: &'static str = "kcf";

    fn start(&self, frame: &Frame, bbox: BBox) -> Result<KcfTracker> {
        self.start_as(Self::OWNER, frame, bbox)
    }

    fn revive(&self, saved: KcfTracker) -> Result<KcfTracker> {
        revive(Self::OWNER, saved)
    }
}

impl TrackerRecipe for KcfFixedParams {
    type Tracker = KcfTracker;

    const SUMMARY: &'static str = "kernelized correlation filter on HOG as published: keeps the size, faster still";
    const PAPER: &'static str = "kcf";

    fn start(&self, frame: &Frame, bbox: BBox) -> Result<KcfTracker> {
        KcfParams::from(self).start_as(Self::OWNER, frame, bbox)
    }

    fn revive(&self, saved: KcfTracker) -> Result<KcfTracker> {
        revive(Self::OWNER, saved)
    }
}

impl TrackerRecipe for CskParams {
    type Tracker = KcfTracker;

    const SUMMARY: &'static str = "kernelized correlation filter on grey values: the circulant structure tracker";
    const PAPER: &'static str = "kcf";

    fn start(&self, frame: &Frame, bbox: BBox) -> Result<KcfTracker> {
        KcfParams::from(self).start_as(Self::OWNER, frame, bbox)
    }

    fn revive(&self, saved: KcfTracker) -> Result<KcfTracker> {
        revive(Self::OWNER, saved)
    }
}
