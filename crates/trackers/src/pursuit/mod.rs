//! The default tracker, `pursuit`: a background-aware filter on gradients and colour names finds the place, a scale filter
//! the size; the filter's peak, the likeness to the first view and the colours say how sure that is; a search beside the
//! main one, and all over once the target is lost, finds it again.

mod localizer;
mod params;
mod peaks;
mod scratch;
mod tracker;

pub use localizer::{Judgement, PursuitLocalizer, PursuitSettings};
pub use params::PursuitParams;
pub use tracker::PursuitTracker;
