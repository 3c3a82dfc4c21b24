//! Small networks.
//!
//! The default one, [`nanotrack::NanoTrackV3`], is written out: its layers are code, its weights plain numbers, and it
//! needs nothing installed.

mod error;
mod kernels;
pub mod nanotrack;

pub use error::InferenceError;

/// The result of a fallible operation on networks.
pub type Result<T, E = InferenceError> = std::result::Result<T, E>;
