//! The default tracker, `pursuit`: a background-aware filter on gradients and colour names finds the place, a scale filter
//! the size, a memory of how the target looked says how sure that is, and a search all over finds it again.

mod localizer;
mod memory;
mod params;
mod policy;
mod scratch;
mod tracker;

pub use localizer::{PursuitLocalizer, PursuitSettings};
pub use memory::Memory;
pub use params::PursuitParams;
pub use policy::{HonestPolicy, HonestThresholds};
pub use tracker::PursuitTracker;
