//! Trackers that follow points: `median-flow` (kalal2010) a box by those in it, `point` a single one; and the follower of boxes that both share
//! with TLD.

mod follower;
mod localizer;
mod params;
mod point;

pub use follower::Follower;
pub use localizer::{MedianFlowLocalizer, MedianFlowTrackerParams, median_flow};
pub use params::{FlowParams, ScaleBy};
pub use point::{PointLocalizer, PointTrackerParams, SURROUNDINGS_PX, Turned, point};
