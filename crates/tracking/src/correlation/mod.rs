//! What the correlation-filter trackers are assembled from: features of a window × a filter that answers them × a search
//! over sizes.

mod assemble;
mod features;
mod localizer;
mod proposer;
mod response;
mod spectrum;
mod template;
#[cfg(test)]
pub(crate) mod twin;

pub use assemble::CorrelationTracker;
pub(crate) use assemble::{revive, start};
pub use features::{Features, GrayFeatures, HogFeatures, LogGrayFeatures};
pub use localizer::{Assembly, Calibration, CorrelationLocalizer, ResponseFilter, SearchSettings, Seen};
pub use proposer::NearThenWide;
pub use response::{PeakQuality, ResponsePeak};
pub use spectrum::Spectra;
pub use template::Template;
