//! Still images: JPEG and PNG.

mod jpeg;
mod labels;
mod png;
mod source;

pub(crate) use jpeg::{JpegScan, decode_jpeg};
pub use labels::{Labels, read_labels};
pub(crate) use source::ImageSource;

use super::fault::Fault;
use super::limits::MAX_SAMPLE_BYTES;
use pursuit_imaging::Pixels;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// The first bytes of every JPEG.
pub(crate) const JPEG_MAGIC: &[u8] = &[0xFF, 0xD8, 0xFF];
/// The first bytes of every PNG.
pub(crate) const PNG_MAGIC: &[u8] = b"\x89PNG\r\n\x1a\n";

/// Decodes a JPEG or PNG by content.
pub(crate) fn decode_image(bytes: &[u8]) -> Result<Pixels, Fault> {
    if bytes.is_empty() {
        Err(Fault::malformed("the file is empty"))
    } else if bytes.starts_with(JPEG_MAGIC) {
        decode_jpeg(bytes)
    } else if bytes.starts_with(PNG_MAGIC) {
        png::decode_png(bytes)
    } else {
        Err(Fault::malformed("it is neither JPEG nor PNG; convert it to one of them"))
    }
}

/// Reads and decodes one image file.
pub(crate) fn read_image(path: &Path) -> Result<Pixels, Fault> {
    decode_image(&read_bounded(path)?)
}

/// A whole file that ought to be small.
pub(crate) fn read_bounded(path: &Path) -> Result<Vec<u8>, Fault> {
    let file = File::open(path)?;
    let mut bytes = Vec::with_capacity(file.metadata()?.len().min(MAX_SAMPLE_BYTES) as usize);
    file.take(MAX_SAMPLE_BYTES + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MAX_SAMPLE_BYTES {
        return Err(Fault::malformed(format!("it is larger than {} MiB", MAX_SAMPLE_BYTES >> 20)));
    }
    Ok(bytes)
}
