//! Small networks.
//!
//! The default one, [`nanotrack::NanoTrackV3`], is written out: its layers are code, its weights plain numbers, and it
//! needs nothing installed. [`siamese`] is the arithmetic around it and its kin, [`detection`] that around detectors of
//! objects. Any other [`Network`] comes from an ONNX file ([`onnx`], with the features `onnxruntime` and `rten`).

pub mod detection;
mod error;
mod kernels;
pub mod nanotrack;
mod network;
pub mod onnx;
mod resample;
pub mod siamese;

pub use error::InferenceError;
pub use network::{Network, Port};

/// The result of a fallible operation on networks.
pub type Result<T, E = InferenceError> = std::result::Result<T, E>;
