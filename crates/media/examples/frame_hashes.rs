//! Prints index, time and CRC-32 of every frame's planes, as `ffmpeg -f framehash -hash CRC32` does: for comparing decoders.
//!
//! `cargo run --release -p pursuit-media --example frame_hashes -- clip.mp4`

use pursuit_imaging::{Frame, Pixels};
use pursuit_media::{OpenOptions, Source, open};
use pursuit_testkit::crc32;

fn main() {
    let input = std::env::args().nth(1).unwrap_or_else(|| "-".to_owned());
    let options = OpenOptions::from_env();
    let mut source = open(&input, &options).unwrap_or_else(|e| {
        eprintln!("{e}");
        std::process::exit(3)
    });
    let info = source.info();
    eprintln!("{}: {} at {:?} frames per second, {:?} frames", info.decoder, info.size, info.fps, info.frame_count);
    loop {
        match source.next_frame() {
            Ok(Some(frame)) => {
                let (bytes, crc) = hash(&frame);
                println!("{}, {:.6}, {bytes}, {crc:08x}", frame.index(), frame.time_s());
            }
            Ok(None) => break,
            Err(error) => {
                eprintln!("{error}");
                std::process::exit(3)
            }
        }
    }
}

/// Number of bytes and CRC-32 of all planes, one after the other.
fn hash(frame: &Frame) -> (usize, u32) {
    let mut bytes = Vec::new();
    match frame.pixels() {
        Pixels::Gray8(image) => image.view().rows().for_each(|row| bytes.extend_from_slice(row)),
        Pixels::Gray16(image) => image.view().rows().flatten().for_each(|v| bytes.extend(v.to_le_bytes())),
        Pixels::Rgb8(image) => image.view().rows().for_each(|row| bytes.extend_from_slice(row.as_flattened())),
        Pixels::Yuv420(image) => {
            let (u, v) = image.chroma();
            for plane in [image.luma(), u, v] {
                plane.rows().for_each(|row| bytes.extend_from_slice(row));
            }
        }
    }
    (bytes.len(), crc32(&bytes))
}
