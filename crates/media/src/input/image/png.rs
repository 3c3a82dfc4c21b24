use super::super::fault::Fault;
use super::super::limits::check_size;
use png::{BitDepth, ColorType, Decoder, Limits, Transformations};
use pursuit_imaging::{Image, Pixels};
use std::io::Cursor;

/// Decodes a PNG: 16-bit grey stays 16-bit, other grey becomes 8-bit grey, everything else 8-bit colour. Alpha is dropped.
pub(super) fn decode_png(bytes: &[u8]) -> Result<Pixels, Fault> {
    let mut decoder = Decoder::new_with_limits(Cursor::new(bytes), Limits { bytes: 1 << 30 });
    let header = decoder.read_header_info().map_err(fault)?;
    let size = check_size(header.width.into(), header.height.into())?;
    let gray16 = header.bit_depth == BitDepth::Sixteen
        && matches!(header.color_type, ColorType::Grayscale | ColorType::GrayscaleAlpha);
    let keep_depth = if gray16 { Transformations::EXPAND } else { Transformations::normalize_to_color8() };
    decoder.set_transformations(keep_depth);
    let mut reader = decoder.read_info().map_err(fault)?;
    let length = reader.output_buffer_size().ok_or_else(|| Fault::malformed("its PNG header makes no sense"))?;
    let mut data = vec![0; length];
    let info = reader.next_frame(&mut data).map_err(fault)?;
    data.truncate(info.buffer_size());
    let (w, h) = (size.width, size.height);
    Ok(match (info.color_type, info.bit_depth) {
        (ColorType::Grayscale, BitDepth::Sixteen) => Image::from_vec(wide::<2>(&data), w, h)?.into(),
        (ColorType::GrayscaleAlpha, BitDepth::Sixteen) => Image::from_vec(wide::<4>(&data), w, h)?.into(),
        (ColorType::Grayscale, BitDepth::Eight) => Image::from_vec(data, w, h)?.into(),
        (ColorType::GrayscaleAlpha, BitDepth::Eight) => {
            Pixels::Gray8(Image::from_vec(data.as_chunks::<2>().0.iter().map(|p| p[0]).collect(), w, h)?.into())
        }
        (ColorType::Rgb, BitDepth::Eight) => Image::from_vec(data.as_chunks::<3>().0.to_vec(), w, h)?.into(),
        (ColorType::Rgba, BitDepth::Eight) => {
            let rgb = data.as_chunks::<4>().0.iter().map(|&[r, g, b, _]| [r, g, b]).collect();
            Pixels::Rgb8(Image::from_vec(rgb, w, h)?.into())
        }
        (color, depth) => return Err(Fault::unsupported(format!("PNG with {color:?} pixels of depth {depth:?}"))),
    })
}

/// The first big-endian sample of every pixel of `N` bytes.
fn wide<const N: usize>(data: &[u8]) -> Vec<u16> {
    data.as_chunks::<N>().0.iter().map(|pixel| u16::from_be_bytes([pixel[0], pixel[1]])).collect()
}

pub(super) fn fault(error: png::DecodingError) -> Fault {
    Fault::malformed(match error {
        png::DecodingError::IoError(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => {
            "the PNG ends early; copy it again".to_owned()
        }
        other => format!("the PNG is damaged ({other})"),
    })
}
