//! Trackers that follow points: `median-flow` (kalal2010), and the follower of boxes that it shares with TLD.

mod follower;
mod localizer;
mod params;

pub use follower::Follower;
pub use localizer::{MedianFlowLocalizer, MedianFlowTrackerParams, median_flow};
pub use params::{FlowParams, ScaleBy};
