//! JPEG images one after the other.

use crate::limits::MAX_SAMPLE_BYTES;
use crate::{ContainerError, Result};
use std::io::{BufRead, Read};

/// The next image's bytes, from its start to its end marker; `None` when the stream ends between images.
///
/// A segment's content is taken by its length, so that thumbnails inside a header do not end the image.
///
/// # Errors
/// [`ContainerError::Malformed`] when the stream ends within an image, or one is longer than
/// [`MAX_SAMPLE_BYTES`].
pub fn next_image(reader: &mut impl BufRead) -> Result<Option<Vec<u8>>> {
    let mut image = Vec::new();
    // Whatever stands between images (line ends, padding) is skipped up to the next start marker.
    loop {
        match byte(reader)? {
            None => return Ok(None),
            Some(0xD8) if image.last() == Some(&0xFF) => break,
            Some(b) => image = vec![b],
        }
    }
    image.push(0xD8);
    let early = || ContainerError::malformed("the stream ends in the middle of a frame");
    loop {
        reader.by_ref().take(MAX_SAMPLE_BYTES).read_until(0xFF, &mut image)?;
        let mut marker = byte(reader)?.ok_or_else(early)?;
        while marker == 0xFF {
            marker = byte(reader)?.ok_or_else(early)?;
        }
        image.push(marker);
        if image.len() as u64 > MAX_SAMPLE_BYTES {
            return Err(ContainerError::malformed(format!(
                "a frame of more than {MAX_SAMPLE_BYTES} bytes cannot be right"
            )));
        }
        match marker {
            0xD9 => return Ok(Some(image)),
            0x00 | 0x01 | 0xD0..=0xD8 => {}
            _ => {
                let length = [byte(reader)?.ok_or_else(early)?, byte(reader)?.ok_or_else(early)?];
                image.extend(length);
                let body = u64::from(u16::from_be_bytes(length).saturating_sub(2));
                if reader.by_ref().take(body).read_to_end(&mut image)? as u64 != body {
                    return Err(early());
                }
            }
        }
    }
}

fn byte(reader: &mut impl BufRead) -> Result<Option<u8>> {
    let next = reader.fill_buf()?.first().copied();
    reader.consume(usize::from(next.is_some()));
    Ok(next)
}
