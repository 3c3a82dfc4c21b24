//! Correlation filters: one localizer, assembled from features × filter × scale × peaks × evidence.
//!
//! | part | what there is |
//! |---|---|
//! | features ([`FeatureKind`](crate::features::FeatureKind)) | grey, log grey, HOG, HOG with grey and colour names |
//! | filter ([`filters`]) | MOSSE, kernelized, compressed, regularised, reliable |
//! | mask ([`GuideParams`]) | none, or one that says what of the box the filter learns |
//! | scale | a ladder of sizes tried, a filter along scale ([`scale`]), or both |
//! | peaks ([`PeakParams`]) | one or several, between the cells by a parabola or the response's own series |
//! | evidence ([`ScoreParams`]) | peak, PSR, collapse, likeness to the initial template, colours → one probability |

pub mod filters;
mod guide;
mod localizer;
mod params;
mod peaks;
#[cfg(test)]
pub(crate) mod reference;
pub mod scale;
mod score;
mod search_window;
pub mod spec;

pub use guide::GuideParams;
pub use localizer::CorrelationLocalizer;
pub use params::{
    ColorParams, Likeness, PeakParams, ReliabilityParams, ScaleFilterParams, ScaleLadderParams, ScoreParams,
    SolverParams, Subpixel, SweepBy, WindowParams, WindowShape,
};
pub use peaks::{Peaks, ResponsePeak};
pub use score::{CorrelationFigures, Evidence, PeakBaseline, peak_quality};
pub use search_window::SearchWindow;
pub use spec::CorrelationSpec;
