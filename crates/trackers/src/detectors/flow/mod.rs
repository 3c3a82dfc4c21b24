//! What moves otherwise than the scene before a camera that moves itself: dense flow, less the camera's own motion.
//!
//! The camera's motion is the similarity that most of the picture agrees on (sparse flow there and back, MSAC). What is left of the
//! dense flow (kroeger2016) is a mover's where it is longer than noise, and where it explains the picture better than the camera's
//! motion does. A scene with much depth moves by parallax: near things stand out like movers.

mod detector;
mod params;
mod residual;

pub use params::FlowDetectorParams;

pub(crate) use super::motion::detected_motion;
