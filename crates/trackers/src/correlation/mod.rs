//! What the correlation-filter trackers are assembled from: features of a window × a filter that answers them × a search
//! over sizes.

mod assemble;
mod calibration;
mod features;
mod first_view;
mod localizer;
mod proposer;
mod response;
mod spectrum;
mod support;
mod template;
#[cfg(test)]
pub(crate) mod twin;

pub use assemble::CorrelationTracker;
pub(crate) use assemble::{revive, start};
pub use calibration::{Calibration, Evidence, UsualPeak};
pub use features::{Features, GrayFeatures, HogFeatures, LogGrayFeatures};
pub use first_view::{FirstView, Likeness};
pub use localizer::{Assembly, CorrelationLocalizer, ResponseFilter, SearchSettings, Seen};
pub use proposer::NearThenWide;
pub use response::{PeakQuality, ResponsePeak};
pub use spectrum::{Spectra, mean_power};
pub use support::Support;
pub use template::Template;
