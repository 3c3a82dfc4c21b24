use crate::{MediaError, Result};
use pursuit_imaging::{ImageView, Rgb8};
use std::path::Path;

/// Writes a JPEG file (4:2:0, `quality` 1–100), for thumbnails.
///
/// # Errors
/// [`MediaError::Unwritable`] when it cannot be encoded or written.
pub fn write_jpeg(path: &Path, image: ImageView<'_, Rgb8>, quality: u8) -> Result<()> {
    let unwritable = |reason: String| MediaError::Unwritable { name: path.display().to_string(), reason };
    let bytes = encode_jpeg(image, quality).map_err(|e| match e {
        MediaError::Unwritable { reason, .. } => unwritable(reason),
        other => other,
    })?;
    std::fs::write(path, bytes).map_err(|e| unwritable(e.to_string()))
}

/// The bytes of a JPEG file (4:2:0, `quality` 1–100), for whoever sends pictures instead of keeping them.
///
/// # Errors
/// [`MediaError::Unwritable`] when a side is longer than JPEG allows.
pub fn encode_jpeg(image: ImageView<'_, Rgb8>, quality: u8) -> Result<Vec<u8>> {
    let unwritable = |reason: String| MediaError::Unwritable { name: "a JPEG picture".to_owned(), reason };
    let image = image.to_image();
    let side =
        |v: usize| u16::try_from(v).map_err(|_| unwritable(format!("a side of {v} pixels is too long for JPEG")));
    let (width, height) = (side(image.width())?, side(image.height())?);
    let mut bytes = Vec::new();
    let mut encoder = jpeg_encoder::Encoder::new(&mut bytes, quality.clamp(1, 100));
    encoder.set_sampling_factor(jpeg_encoder::SamplingFactor::F_2_2);
    let encoded = encoder.encode(image.as_slice().as_flattened(), width, height, jpeg_encoder::ColorType::Rgb);
    encoded.map_err(|e| unwritable(e.to_string()))?;
    Ok(bytes)
}

/// Writes a PNG file.
///
/// # Errors
/// [`MediaError::Unwritable`] when it cannot be written.
pub fn write_png(path: &Path, image: ImageView<'_, Rgb8>) -> Result<()> {
    let unwritable = |reason: String| MediaError::Unwritable { name: path.display().to_string(), reason };
    let image = image.to_image();
    let mut bytes = Vec::new();
    // Sides are at most `Image::MAX_SIDE`.
    let mut encoder = png::Encoder::new(&mut bytes, image.width() as u32, image.height() as u32);
    encoder.set_color(png::ColorType::Rgb);
    let encoded = encoder.write_header().and_then(|mut w| w.write_image_data(image.as_slice().as_flattened()));
    encoded.map_err(|e| unwritable(e.to_string()))?;
    std::fs::write(path, bytes).map_err(|e| unwritable(e.to_string()))
}
