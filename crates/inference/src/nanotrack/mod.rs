//! NanoTrack v3 (github.com/HonglinChu/SiamTrackers, Apache-2.0), written out: its layers as code, its weights as plain
//! numbers in half precision.

mod engine;
mod head;

pub use crate::written::Patch;

use crate::written::WrittenOut;

/// NanoTrack v3 and a template.
///
/// The images have blue, green and red, from 0 to 255; the template's features are 96 × 8 × 8 numbers. The scores are two logits,
/// background and target (2 × 15 × 15), the boxes four distances in pixels of the search image: left, top, right and bottom (4 × 15 × 15).
pub type NanoTrackV3 = WrittenOut<engine::Engine>;
