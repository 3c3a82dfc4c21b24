//! Reading MP4 and QuickTime files (ISO/IEC 14496-12): where each video sample lies and when it is shown.
//!
//! Written for files from outside: every count is checked against the bytes that are really there, a file whose end is
//! missing gives the samples it still has, and only the index is held in memory.

mod boxes;
mod edits;
mod fragments;
mod movie;
mod samples;

pub(crate) use movie::Movie;

use super::color::ColorInfo;

/// One compressed picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Sample {
    /// First byte in the file.
    pub offset: u64,
    /// Length in bytes.
    pub size: u32,
    /// When it is shown, in units of the track's time scale, before edits.
    pub composition_time: i64,
}

/// How the pictures of a track are coded.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Codec {
    /// H.264 with length-prefixed units.
    Avc(AvcConfig),
    /// Anything else, by its four-character code.
    Other(String),
}

/// The decoder configuration of an H.264 track (ISO/IEC 14496-15 §5.3.3).
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct AvcConfig {
    /// Bytes of each unit's length field.
    pub length_bytes: usize,
    /// Sequence parameter sets, without start codes.
    pub sps: Vec<Vec<u8>>,
    /// Picture parameter sets, without start codes.
    pub pps: Vec<Vec<u8>>,
    /// What the container says about colour.
    pub color: ColorInfo,
}
