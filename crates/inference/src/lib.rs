//! Small networks.
//!
//! Three trackers' networks are written out, [`nanotrack::NanoTrackV3`], [`lightfc::LightFc`] and [`vittrack::VitTrack`]: their
//! layers are code over one set of kernels, their weights plain numbers, and they need nothing installed. [`siamese`] is the arithmetic around them and their kin, [`detection`] that around detectors of
//! objects, [`segmentation`] that around networks that draw masks. Any other [`Network`] comes from an ONNX file ([`onnx`], with the features `onnxruntime` and `rten`).

mod backbone;
pub mod detection;
pub mod embedding;
mod error;
mod kernels;
pub mod lightfc;
pub mod nanotrack;
mod network;
pub mod onnx;
mod resample;
pub mod segmentation;
mod shared;
pub mod siamese;
pub mod vittrack;
mod weights;
mod written;

pub use error::InferenceError;
pub use network::{Network, Port};

/// The result of a fallible operation on networks.
pub type Result<T, E = InferenceError> = std::result::Result<T, E>;
