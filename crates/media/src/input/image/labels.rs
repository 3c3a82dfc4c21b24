use super::super::fault::Fault;
use super::super::limits::check_size;
use super::png::fault;
use super::read_bounded;
use crate::MediaError;
use png::{BitDepth, ColorType, Decoder, Limits, Transformations};
use pursuit_imaging::Image;
use std::io::Cursor;
use std::path::Path;

/// A picture that says of which object each pixel is.
#[derive(Debug, Clone)]
pub struct Labels {
    /// The numbers of the pixels: of their colours in the palette, or of shades of grey as they are stored.
    pub numbers: Image<u8>,
    /// Whether there is a palette.
    pub is_indexed: bool,
}

/// Reads a PNG of numbered colours or of shades of grey, at most eight bits a pixel.
///
/// # Errors
/// [`MediaError`] for a file that cannot be read, that is damaged, or that is no such picture.
pub fn read_labels(path: &Path) -> Result<Labels, MediaError> {
    read_bounded(path).and_then(|bytes| decode(&bytes)).map_err(|f| f.unreadable(&path.display().to_string()))
}

fn decode(bytes: &[u8]) -> Result<Labels, Fault> {
    let mut decoder = Decoder::new_with_limits(Cursor::new(bytes), Limits { bytes: 1 << 30 });
    let header = decoder.read_header_info().map_err(fault)?;
    let size = check_size(header.width.into(), header.height.into())?;
    decoder.set_transformations(Transformations::IDENTITY);
    let mut reader = decoder.read_info().map_err(fault)?;
    let (color, depth) = reader.output_color_type();
    let is_indexed = match color {
        ColorType::Indexed => true,
        ColorType::Grayscale if depth != BitDepth::Sixteen => false,
        _ => {
            let kind = format!("{color:?} pixels of depth {depth:?}");
            return Err(Fault::malformed(format!(
                "it has {kind}; annotations have numbered colours or shades of grey, of at most 8 bits"
            )));
        }
    };
    let length = reader.output_buffer_size().ok_or_else(|| Fault::malformed("its PNG header makes no sense"))?;
    let mut packed = vec![0; length];
    reader.next_frame(&mut packed).map_err(fault)?;
    let bits = depth as usize;
    // Of pixels of less than a byte the first has the highest bits, and rows begin with a byte of their own.
    let number = |row: &[u8], x: usize| {
        let byte = row.get(x * bits / 8).copied().unwrap_or(0);
        byte >> (8 - bits - x * bits % 8) & (0xff >> (8 - bits))
    };
    let rows = packed.chunks((size.width * bits).div_ceil(8)).take(size.height);
    let numbers = rows.flat_map(|row| (0..size.width).map(move |x| number(row, x))).collect();
    Ok(Labels { numbers: Image::from_vec(numbers, size.width, size.height)?, is_indexed })
}
