//! What the correlation-filter trackers are assembled from: features of a window.

mod features;

pub use features::{Features, GrayFeatures, HogFeatures};
