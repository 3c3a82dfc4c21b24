//! VitTrack (opencv_zoo's `object_tracking_vittrack_2023sep`, Apache-2.0), written out: its layers as code, its weights as plain numbers
//! in single precision. The pixels of template and search image are one sequence of tokens, as in OSTrack (Ye et al. 2022,
//! arXiv:2203.11991), so that every search looks at both.

mod block;
mod engine;
mod head;
mod stem;

use crate::written::WrittenOut;

/// Channels of a token.
const CHANNELS: usize = 48;
/// Tokens in a row of the map that holds them.
const COLUMNS: usize = 16;
/// Rows of the template's tokens, and of the search image's.
const ROWS: [usize; 2] = [4, 16];
const TOKEN_ROWS: usize = ROWS[0] + ROWS[1];
const POINTS: usize = COLUMNS * ROWS[1];

/// VitTrack and a template.
///
/// The images have red, green and blue, normalised; the template's features are 48 × 8 × 8 numbers. The scores are the probability of each
/// point (16 × 16), the boxes width and height by the side of the image and the middle relative to the point in points, across and
/// down (4 × 16 × 16).
pub type VitTrack = WrittenOut<engine::Engine>;
