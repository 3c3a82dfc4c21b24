//! Continuous convolution: `c-cot` (danelljan2016) and `eco-hc` (danelljan2017eco). Feature maps of any resolution become functions
//! of a continuous place, and so does the response; the filter is trained on all samples seen, or on a compact mixture of them, by
//! conjugate gradients on Fourier coefficients.
//!
//! | part | where |
//! |---|---|
//! | maps to functions, the label | `interpolation` |
//! | which coefficients there are, and in which order | `coefficients`, `blocks` |
//! | the weight over the window | `spatial` |
//! | what is kept of the samples: a mixture, or sums over every one | `memory`, `sample_space`, `moments` |
//! | the error that is minimised | `objective` |
//! | the solver | `gradients` |
//! | the compression, learned in the first frame | `factorised` |

mod blocks;
mod coefficients;
mod factorised;
mod gradients;
mod interpolation;
mod localizer;
mod memory;
mod model;
mod moments;
mod objective;
mod params;
mod sample_space;
mod spatial;
#[cfg(test)]
mod tests;
mod view;

pub use localizer::{ContinuousLocalizer, ContinuousPeak};
pub use params::{
    CompressionModel, CompressionParams, ConjugateGradientParams, ContinuousParams, SampleModel, SampleParams,
    SpatialWeightParams, SquareWindowParams,
};

use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_tracking::motion::MotionParams;
use pursuit_tracking::policy::PolicyParams;
use pursuit_tracking::search::SearchParams;
use pursuit_tracking::{GroupParams, LocalizerRecipe, Result, TrackerRecipe};

impl LocalizerRecipe for ContinuousParams {
    type Localizer = ContinuousLocalizer;

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<ContinuousLocalizer> {
        Ok(ContinuousLocalizer::new(self, frame, &bbox))
    }
}

/// `eco-hc`: efficient convolution operators on gradients and colour names.
pub fn eco_hc(name: &'static str) -> TrackerRecipe<ContinuousParams> {
    let groups = GroupParams {
        motion: MotionParams::calm(),
        // By the usual thresholds a third of the frames without the target were told as tracked.
        policy: PolicyParams { occluded_below: 0.5, seen_from: 0.6, found_from: 0.6, ..PolicyParams::default() },
        search: SearchParams { wide_windows: 6, ..SearchParams::at_last_place() },
    };
    TrackerRecipe { name, localizer: ContinuousParams::default(), groups }
}

/// `c-cot`: continuous convolution operators on gradients and colour names, none of them compressed.
pub fn c_cot(name: &'static str) -> TrackerRecipe<ContinuousParams> {
    let localizer = ContinuousParams::danelljan2016();
    TrackerRecipe { name, localizer, groups: eco_hc(name).groups }
}
