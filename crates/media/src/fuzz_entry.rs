//! One function for each parser, for fuzz targets and mutation tests: arbitrary bytes in, no panic, no hang, bounded memory.
//!
//! Not part of the interface; may change at any time.

use crate::input::annotations::{read_list, read_truth};
use crate::input::avi::AviSource;
use crate::input::image::decode_image;
use crate::input::mjpeg::{self, MjpegSource};
#[cfg(feature = "h264")]
use crate::input::mp4::Mp4Source;
use crate::input::y4m::Y4mSource;
use crate::{Source, Truth};
use std::io::Cursor;

/// Pixels decoded from one input at most: a few bytes can rightly stand for many large frames.
const PIXEL_BUDGET: usize = 1 << 23;

/// Reads frames until the end, the first error or the budget; how many there were.
fn drain(mut source: impl Source) -> usize {
    let size = source.info().size;
    let frames = (PIXEL_BUDGET / size.area().max(1)).clamp(1, 256);
    (0..frames)
        .take_while(|_| match source.next_frame() {
            Ok(frame) => frame.is_some_and(|f| f.size() == size),
            Err(error) => error.is_damage(),
        })
        .count()
}

/// MP4 and H.264. How many frames could be decoded.
#[cfg(feature = "h264")]
pub fn mp4(bytes: &[u8]) -> usize {
    Mp4Source::new(Box::new(Cursor::new(bytes.to_vec())), "fuzz").map_or(0, drain)
}

/// AVI and Motion JPEG. How many frames could be decoded.
pub fn avi(bytes: &[u8]) -> usize {
    AviSource::new(Box::new(Cursor::new(bytes.to_vec())), "fuzz").map_or(0, drain)
}

/// Y4M. How many frames could be read.
pub fn y4m(bytes: &[u8]) -> usize {
    Y4mSource::new(Cursor::new(bytes), "fuzz", Some(bytes.len() as u64), 30.0).map_or(0, drain)
}

/// Bare Motion JPEG. How many frames could be decoded.
pub fn mjpeg(bytes: &[u8]) -> usize {
    mjpeg::is_stream(&mut Cursor::new(bytes));
    MjpegSource::new(Cursor::new(bytes), "fuzz", 30.0).map_or(0, drain)
}

/// PNG and JPEG. One where it could be decoded.
pub fn image(bytes: &[u8]) -> usize {
    usize::from(decode_image(bytes).is_ok())
}

/// `frames.csv` and truth files. How many rows could be read.
pub fn list(bytes: &[u8]) -> usize {
    let visible = |truth: &Truth| truth.bbox().is_none_or(|bbox| bbox.is_finite() && bbox.width() > 0.0);
    if let Ok(Some(truth)) = read_truth(bytes, "fuzz") {
        assert!(truth.iter().all(visible), "a truth that is no box");
    }
    read_list(bytes, "fuzz").map_or(0, |rows| rows.len())
}
