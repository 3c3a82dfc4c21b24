//! Optical flow: image pyramids, pyramidal Lucas-Kanade, corners that can be followed, the median-flow estimate of a box's motion,
//! and dense fields.
//!
//! A [`Pyramid`] is made once a frame and shared by everybody who follows points in it. Gradients are made per window by
//! [`LucasKanade`], not per image: a few hundred windows cover less than the picture does.

mod appearance;
pub mod dense;
mod follow;
mod good_features;
mod kernel;
mod lucas_kanade;
mod median_flow;
mod pyramid;
mod template;

pub use appearance::{Appearance, Likeness};
pub use follow::{FollowedPoint, PointFollower, PointFollowerParams, PointState};
pub use good_features::{GoodFeature, GoodFeatures, GoodFeaturesParams};
pub use lucas_kanade::{Lighting, LucasKanade, LucasKanadeParams, Outcome, RoundTrip, Start, Track};
pub use median_flow::{BoxMotion, FlowFailure, MedianFlow, MedianFlowParams, Pairing, ScaleRule, box_motion, grid};
pub use pyramid::Pyramid;

#[cfg(test)]
mod box_tests;
#[cfg(test)]
pub(crate) mod tests;
