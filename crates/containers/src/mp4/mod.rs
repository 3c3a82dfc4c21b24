//! MP4 and QuickTime files (ISO/IEC 14496-12): where each video sample lies and when it is shown, and how to write one.
//!
//! Reading is written for files from outside: every count is checked against the bytes that are really there, a file whose end is
//! missing gives the samples it still has, and only the index is held in memory.

mod announced;
mod boxes;
mod edits;
mod fragments;
mod movie;
mod samples;
mod write;

pub use edits::Edits;
pub use movie::{Movie, VideoTrack};
pub use write::{EncodedSample, Writer};

/// One compressed picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sample {
    /// First byte in the file.
    pub offset: u64,
    /// Length in bytes.
    pub size: u32,
    /// When it is shown, in units of the track's time scale, before edits.
    pub composition_time: i64,
}

/// How the pictures of a track are coded.
#[derive(Debug, Clone, PartialEq)]
pub enum Codec {
    /// H.264 with length-prefixed units.
    Avc(AvcConfig),
    /// Anything else, by its four-character code.
    Other(String),
}

/// The decoder configuration of an H.264 track (ISO/IEC 14496-15 §5.3.3).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct AvcConfig {
    /// Bytes of each unit's length field.
    pub length_bytes: usize,
    /// Sequence parameter sets, without start codes.
    pub sps: Vec<Vec<u8>>,
    /// Picture parameter sets, without start codes.
    pub pps: Vec<Vec<u8>>,
    /// What the container says about colour.
    pub color: ColorTags,
    /// Width against height of a pixel, where the container says so (`pasp`).
    pub pixel_aspect: Option<(u32, u32)>,
}

/// What a container says about colours; `None` where it says nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ColorTags {
    /// `matrix_coefficients` of ITU-T H.273 table 4.
    pub matrix_code: Option<u8>,
    /// Whether samples use their full range.
    pub full_range: Option<bool>,
}
