use super::{AppearanceFeatures, RegularisedFilter, SolverSettings};
use crate::correlation::{
    Assembly, Calibration, CorrelationTracker, Features, SearchSettings, Template, revive, start,
};
use crate::parameters::Parameters;
use crate::policy::ConfidenceThresholds;
use crate::{Result, TrackerRecipe};
use pursuit_geometry::{BBox, Size};
use pursuit_imaging::Frame;
use serde::{Deserialize, Serialize};

/// What a regularised correlation tracker is made of.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RegularisedAssembly {
    color: bool,
    padding: f64,
    cell_px: usize,
    area_px: (f64, f64),
    label_sigma: f64,
    solver: SolverSettings,
    settings: SearchSettings,
}

impl Assembly for RegularisedAssembly {
    type Features = AppearanceFeatures;
    type Filter = RegularisedFilter;

    fn template(&self, bbox: &BBox) -> Template {
        Template::new(bbox, self.padding, self.cell_px, self.area_px.0, self.area_px.1)
    }

    fn features(&self) -> AppearanceFeatures {
        AppearanceFeatures::new(self.cell_px, self.color)
    }

    fn filter(&self, template: &Template, grid: Size) -> RegularisedFilter {
        let (width, height) = template.target_in_patch();
        let (width, height) = (width / self.cell_px as f64, height / self.cell_px as f64);
        let sigma = self.label_sigma * (width * height).sqrt();
        let channels = self.features().channels();
        RegularisedFilter::new(self.solver, grid, channels, (width, height), sigma)
    }

    fn settings(&self) -> &SearchSettings {
        &self.settings
    }
}

crate::parameters! {
    /// Parameters of the background-aware correlation filter (galoogahi2017).
    pub struct BacfParams for "bacf" {
        /// Side of a feature cell in patch pixels (section 4: 4), 2 to 16.
        pub cell_px: usize = 4,
        /// Side of the window as a multiple of the target's (released code: 5), 2 to 8.
        pub search: f64 = 5.0,
        /// Largest area of the patch in pixels (released code: 50² cells of 4 pixels), > 0.
        pub largest_area_px: f64 = 40_000.0,
        /// Smallest area of the patch in pixels, > 0.
        pub smallest_area_px: f64 = 40_000.0,
        /// Standard deviation of the label as a share of √(width · height) of the target (section 4: 1/16), > 0.
        pub label_sigma: f64 = 0.0625,
        /// Share of the new sample in the model, η (eq. 11; section 4: 0.013), `[0, 1]`.
        pub learning_rate: f64 = 0.013,
        /// First penalty of the alternating directions (section 4: 1), > 0.
        pub penalty: f64 = 1.0,
        /// Growth of the penalty per iteration (section 4: 10), ≥ 1.
        pub penalty_growth: f64 = 10.0,
        /// Iterations per frame (section 4: 2), 1 to 10.
        pub iterations: usize = 2,
        /// Sizes tried on either side of the last one (section 4: 5 in all), at most 8.
        pub scale_levels: usize = 2,
        /// Ratio of neighbouring sizes (section 4: 1.01), `(1, 2]`.
        pub scale_step: f64 = 1.01,
    }
    validate(self) {
        check_common::<Self>(self.cell_px, self.search, (self.smallest_area_px, self.largest_area_px), self.label_sigma)?;
        check_solver::<Self>(self.penalty, self.penalty_growth, self.iterations)?;
        check_scales::<Self>(self.scale_levels, self.scale_step)?;
        if !(0.0..=1.0).contains(&self.learning_rate) {
            return Err(Self::reject("learning_rate", "must be between 0 and 1"));
        }
    }
}

crate::parameters! {
    /// Parameters of the spatial-temporal regularised correlation filter (li2018).
    pub struct StrcfParams for "strcf" {
        /// Side of a feature cell in patch pixels (section 5.1: 4), 2 to 16.
        pub cell_px: usize = 4,
        /// Side of the window as a multiple of the target's (released code: 5), 2 to 8.
        pub search: f64 = 5.0,
        /// Largest area of the patch in pixels (released code: 250²), > 0.
        pub largest_area_px: f64 = 40_000.0,
        /// Smallest area of the patch in pixels (released code: 200²), > 0.
        pub smallest_area_px: f64 = 40_000.0,
        /// Standard deviation of the label as a share of √(width · height) of the target (released code: 1/16), > 0.
        pub label_sigma: f64 = 0.0625,
        /// Weight μ of staying near the last filter (eq. 4), relative to the features' mean energy in the first window,
        /// ≥ 0.
        pub temporal_weight: f64 = 15.0,
        /// Weight w² of the filter inside the target (released code: 1e-3 squared), ≥ 0; outside it is infinite.
        pub spatial_weight: f64 = 1e-6,
        /// First penalty γ of the alternating directions, > 0 (released code: 1).
        pub penalty: f64 = 1.0,
        /// Growth ρ of the penalty per iteration (eq. 12; released code: 10), ≥ 1.
        pub penalty_growth: f64 = 10.0,
        /// Iterations per frame (section 5.1: 2), 1 to 10.
        pub iterations: usize = 2,
        /// Sizes tried on either side of the last one (released code: 5 in all), at most 8.
        pub scale_levels: usize = 2,
        /// Ratio of neighbouring sizes (released code: 1.01), `(1, 2]`.
        pub scale_step: f64 = 1.01,
    }
    validate(self) {
        check_common::<Self>(self.cell_px, self.search, (self.smallest_area_px, self.largest_area_px), self.label_sigma)?;
        check_solver::<Self>(self.penalty, self.penalty_growth, self.iterations)?;
        check_scales::<Self>(self.scale_levels, self.scale_step)?;
        for (name, weight) in [("temporal_weight", self.temporal_weight), ("spatial_weight", self.spatial_weight)] {
            if !(weight >= 0.0 && weight.is_finite()) {
                return Err(Self::reject(name, "must not be negative"));
            }
        }
    }
}

fn check_common<P: Parameters>(cell_px: usize, search: f64, area: (f64, f64), sigma: f64) -> Result<()> {
    if !(2..=16).contains(&cell_px) {
        return Err(P::reject("cell_px", "must be between 2 and 16"));
    }
    if !(2.0..=8.0).contains(&search) {
        return Err(P::reject("search", "must be between 2 and 8"));
    }
    if !((1024.0..=1e6).contains(&area.0) && area.0 <= area.1 && area.1 <= 1e6) {
        return Err(P::reject("smallest_area_px", "must be between 1024 and largest_area_px, at most a million"));
    }
    if !(sigma > 0.0 && sigma < 1.0) {
        return Err(P::reject("label_sigma", "must be above 0 and below 1"));
    }
    Ok(())
}

fn check_solver<P: Parameters>(penalty: f64, growth: f64, iterations: usize) -> Result<()> {
    if !(penalty > 0.0 && penalty.is_finite()) {
        return Err(P::reject("penalty", "must be above 0"));
    }
    if !(1.0..=1000.0).contains(&growth) {
        return Err(P::reject("penalty_growth", "must be between 1 and 1000"));
    }
    if !(1..=10).contains(&iterations) {
        return Err(P::reject("iterations", "must be between 1 and 10"));
    }
    Ok(())
}

fn check_scales<P: Parameters>(levels: usize, step: f64) -> Result<()> {
    if levels > 8 {
        return Err(P::reject("scale_levels", "must be at most 8"));
    }
    if !(step > 1.0 && step <= 2.0) {
        return Err(P::reject("scale_step", "must be above 1 and at most 2"));
    }
    Ok(())
}

/// Spectral density of the acceleration, sizes² per s³.
const ACCELERATION: f64 = 30.0;

fn search_settings(levels: usize, step: f64, learning_rate: f64, calibration: Calibration) -> SearchSettings {
    SearchSettings {
        scale_factors: SearchSettings::scale_ladder(step, levels),
        scale_penalty: 1.0,
        scale_gain: 1.0,
        learning_rate,
        wide_windows: 6,
        first_samples: 1,
        calibration,
    }
}

/// Fitted as `docs/papers/bacf.md` says.
const BACF_CALIBRATION: Calibration = Calibration { bias: -7.0, psr: 3.0, collapse: 1.1, first_view: 2.3 };
/// Fitted as `docs/papers/bacf.md` says.
const STRCF_CALIBRATION: Calibration = Calibration { bias: -2.8, psr: 0.95, collapse: 1.5, first_view: 4.1 };

impl TrackerRecipe for BacfParams {
    type Tracker = CorrelationTracker<RegularisedAssembly>;

    const SUMMARY: &'static str = "background-aware correlation filter on gradients and colour names: accurate, quick";
    const PAPER: &'static str = "bacf";

    fn start(&self, frame: &Frame, bbox: BBox) -> Result<Self::Tracker> {
        let assembly = RegularisedAssembly {
            color: frame.has_color(),
            padding: self.search - 1.0,
            cell_px: self.cell_px,
            area_px: (self.smallest_area_px, self.largest_area_px),
            label_sigma: self.label_sigma,
            solver: SolverSettings {
                temporal_weight: 0.0,
                spatial_weight: 0.0,
                penalty: self.penalty,
                penalty_growth: self.penalty_growth,
                iterations: self.iterations,
            },
            settings: search_settings(self.scale_levels, self.scale_step, self.learning_rate, BACF_CALIBRATION),
        };
        start(Self::OWNER, assembly, ACCELERATION, ConfidenceThresholds::CAUTIOUS, frame, bbox)
    }

    fn revive(&self, saved: Self::Tracker) -> Result<Self::Tracker> {
        revive(Self::OWNER, saved)
    }
}

impl TrackerRecipe for StrcfParams {
    type Tracker = CorrelationTracker<RegularisedAssembly>;

    const SUMMARY: &'static str =
        "spatial-temporal regularised correlation filter: learns each frame anew, near the last";
    const PAPER: &'static str = "strcf";

    fn start(&self, frame: &Frame, bbox: BBox) -> Result<Self::Tracker> {
        let assembly = RegularisedAssembly {
            color: frame.has_color(),
            padding: self.search - 1.0,
            cell_px: self.cell_px,
            area_px: (self.smallest_area_px, self.largest_area_px),
            label_sigma: self.label_sigma,
            solver: SolverSettings {
                temporal_weight: self.temporal_weight,
                spatial_weight: self.spatial_weight,
                penalty: self.penalty,
                penalty_growth: self.penalty_growth,
                iterations: self.iterations,
            },
            settings: search_settings(self.scale_levels, self.scale_step, 1.0, STRCF_CALIBRATION),
        };
        start(Self::OWNER, assembly, ACCELERATION, ConfidenceThresholds::CAUTIOUS, frame, bbox)
    }

    fn revive(&self, saved: Self::Tracker) -> Result<Self::Tracker> {
        revive(Self::OWNER, saved)
    }
}
