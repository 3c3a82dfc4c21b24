//! What several test files need.
#![allow(dead_code, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use pursuit_imaging::{Frame, Pixels};
use pursuit_media::{OpenOptions, Source, open};
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

/// CRC-32 as in PNG and zip.
fn crc32(bytes: &[u8]) -> u32 {
    let step = |c: u32| if c & 1 == 1 { 0xEDB8_8320 ^ (c >> 1) } else { c >> 1 };
    let table: Vec<u32> = (0..256).map(|n| (0..8).fold(n, |c, _| step(c))).collect();
    !bytes.iter().fold(!0, |c, &b| table[((c ^ u32::from(b)) & 0xFF) as usize] ^ (c >> 8))
}

/// A deterministic source of numbers for tests (SplitMix64).
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    pub fn below(&mut self, bound: usize) -> usize {
        (self.next() % bound as u64) as usize
    }
}
