//! What several test files need.
#![allow(dead_code, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use pursuit_imaging::{Frame, Pixels};
use pursuit_media::{OpenOptions, Source, open};
use pursuit_testkit::crc32;
use std::path::{Path, PathBuf};

/// A committed file.
pub fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(name)
}

/// Opens without any ffmpeg.
pub fn open_built_in(path: &Path) -> Box<dyn Source> {
    open(path.to_str().unwrap(), &OpenOptions::default()).unwrap_or_else(|e| panic!("{e}"))
}

pub fn all_frames(source: &mut dyn Source) -> Vec<Frame> {
    std::iter::from_fn(|| source.next_frame().unwrap()).collect()
}

/// What ffmpeg decoded from a fixture: `index, time, bytes, crc` a line.
pub fn hashes_beside(name: &str) -> Vec<String> {
    let lines = std::fs::read_to_string(fixture(&format!("{name}.frames"))).unwrap();
    lines.lines().map(str::to_owned).collect()
}

/// Number of bytes and CRC-32 of all planes, one after the other.
pub fn hash(frame: &Frame) -> String {
    let mut bytes = Vec::new();
    match frame.pixels() {
        Pixels::Gray8(image) => image.view().rows().for_each(|row| bytes.extend_from_slice(row)),
        Pixels::Gray16(image) => image.view().rows().flatten().for_each(|v| bytes.extend(v.to_le_bytes())),
        Pixels::Rgb8(image) => image.view().rows().for_each(|row| bytes.extend_from_slice(row.as_flattened())),
        Pixels::Yuv420(image) => {
            let (u, v) = image.chroma();
            [image.luma(), u, v].iter().for_each(|p| p.rows().for_each(|row| bytes.extend_from_slice(row)));
        }
    }
    format!("{}, {:08x}", bytes.len(), crc32(&bytes))
}
