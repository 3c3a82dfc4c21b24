//! Sparse optical flow: image pyramids, pyramidal Lucas-Kanade, and the median-flow estimate of a box's motion.
//!
//! A [`Pyramid`] is made once a frame and shared by everybody who follows points in it. Gradients are made per window by
//! [`LucasKanade`], not per image: a few hundred windows cover less than the picture does.

mod kernel;
mod lucas_kanade;
mod median_flow;
mod pyramid;
mod template;

pub use lucas_kanade::{Lighting, LucasKanade, LucasKanadeParams, Outcome, RoundTrip, Start, Track};
pub use median_flow::{BoxMotion, FlowFailure, MedianFlow, MedianFlowParams, Pairing, ScaleRule, box_motion, grid};
pub use pyramid::Pyramid;

#[cfg(test)]
mod box_tests;
#[cfg(test)]
pub(crate) mod tests;
