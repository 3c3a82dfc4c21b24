use super::super::fault::Fault;
use super::super::limits::check_size;
use pursuit_geometry::Size;
use pursuit_imaging::{ColorMatrix, ColorRange, Image, Pixels, Yuv420};
use std::borrow::Cow;
use zune_core::bytestream::ZCursor;
use zune_core::colorspace::ColorSpace;
use zune_core::options::DecoderOptions;
use zune_jpeg::JpegDecoder;

/// What the markers of a JPEG say, read without decoding it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct JpegScan {
    pub size: Size,
    components: u8,
    /// Whether chroma is halved both ways and luma is not.
    is_420: bool,
    /// Whether components are stored as red, green, blue (Adobe marker).
    is_rgb: bool,
    has_huffman_tables: bool,
    /// Where the first scan's header begins.
    start_of_scan: usize,
    /// Bytes up to and with the end marker; `None` when there is none.
    pub end: Option<usize>,
}

impl JpegScan {
    /// Walks the markers (ITU-T T.81 annex B).
    pub fn read(bytes: &[u8]) -> Result<Self, Fault> {
        let mut scan = Self {
            size: Size::default(),
            components: 0,
            is_420: false,
            is_rgb: false,
            has_huffman_tables: false,
            start_of_scan: 0,
            end: None,
        };
        let mut at = 2;
        while let Some(marker) = next_marker(bytes, &mut at) {
            match marker {
                0xD9 => {
                    scan.end = Some(at);
                    break;
                }
                0x01 | 0xD0..=0xD8 => continue,
                _ => {}
            }
            let Some((&[high, low], _)) = bytes.get(at..).and_then(<[u8]>::split_first_chunk) else { break };
            let length = usize::from(u16::from_be_bytes([high, low]));
            let Some(segment) = bytes.get(at + 2..at + length.max(2)) else { break };
            match marker {
                0xC4 => scan.has_huffman_tables = true,
                0xC0..=0xCF if marker != 0xC8 && marker != 0xCC => scan.read_frame_header(segment)?,
                0xEE if segment.starts_with(b"Adobe") => scan.is_rgb = segment.get(11) == Some(&0),
                0xDA if scan.start_of_scan == 0 => scan.start_of_scan = at - 2,
                _ => {}
            }
            at += length.max(2);
        }
        if scan.components == 0 || scan.start_of_scan == 0 {
            return Err(Fault::malformed("the JPEG ends before its picture; copy it again"));
        }
        Ok(scan)
    }

    fn read_frame_header(&mut self, segment: &[u8]) -> Result<(), Fault> {
        let &[_precision, h1, h0, w1, w0, components, ..] = segment else {
            return Err(Fault::malformed("the JPEG's frame header is cut short"));
        };
        let (width, height) = (u16::from_be_bytes([w1, w0]), u16::from_be_bytes([h1, h0]));
        self.size = check_size(width.into(), height.into())?;
        self.components = components;
        let sampling = |i: usize| segment.get(7 + 3 * i).copied();
        self.is_420 = components == 3 && [0, 1, 2].map(sampling) == [Some(0x22), Some(0x11), Some(0x11)];
        Ok(())
    }
}

/// The next marker at or after `at` that is no stuffing and no restart; `at` moves past it.
fn next_marker(bytes: &[u8], at: &mut usize) -> Option<u8> {
    loop {
        let found = bytes.get(*at..)?.iter().position(|&b| b == 0xFF)?;
        *at += found + 1;
        let marker = *bytes.get(*at)?;
        match marker {
            0xFF => {} // fill byte: look at the next one again
            0x00 | 0xD0..=0xD7 => *at += 1,
            _ => {
                *at += 1;
                return Some(marker);
            }
        }
    }
}

/// Decodes a JPEG: grey as grey, the common 4:2:0 colour as the planes it is made of, so that grey costs nothing, every
/// other colour as RGB.
pub(crate) fn decode_jpeg(bytes: &[u8]) -> Result<Pixels, Fault> {
    let scan = JpegScan::read(bytes)?;
    let bytes = with_huffman_tables(bytes, &scan);
    let planar = scan.is_420 && !scan.is_rgb;
    let target = match scan.components {
        1 => ColorSpace::Luma,
        _ if planar => ColorSpace::YCbCr,
        _ => ColorSpace::RGB,
    };
    let options = DecoderOptions::default()
        .set_max_width(scan.size.width)
        .set_max_height(scan.size.height)
        .jpeg_set_out_colorspace(target)
        // Without an end marker the decoder has to be trusted to notice missing data; with one, be as lenient as players.
        .set_strict_mode(scan.end.is_none());
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes.as_ref()), options);
    let data = decoder.decode().map_err(|e| Fault::malformed(format!("the JPEG is damaged ({e})")))?;
    let info = decoder.info().ok_or_else(|| Fault::malformed("the JPEG has no frame header"))?;
    let (w, h) = (usize::from(info.width), usize::from(info.height));
    Ok(match target {
        ColorSpace::Luma => Image::from_vec(data, w, h)?.into(),
        ColorSpace::YCbCr => planes(&data, w, h)?.into(),
        _ => Image::from_vec(data.as_chunks::<3>().0.to_vec(), w, h)?.into(),
    })
}

/// Splits interleaved Y Cb Cr of full size into a luma plane and chroma planes of half size.
fn planes(data: &[u8], width: usize, height: usize) -> Result<Yuv420, Fault> {
    let pixels = data.as_chunks::<3>().0;
    let luma = pixels.iter().map(|p| p[0]).collect();
    let y = Image::from_vec(luma, width, height)?;
    let [u, v] = [1, 2].map(|channel| stored_chroma(pixels, channel, width, height));
    Ok(Yuv420::new(y, u?, v?, ColorMatrix::Bt601, ColorRange::Full)?)
}

/// Undoes the decoder's interpolation of chroma, up to rounding: within three codes of ffmpeg's planes on what was tried.
///
/// It makes two samples of each stored one, three parts of that and one part of its neighbour:
/// `a[2i] = (3 c[i] + c[i - 1]) / 4`, `a[0] = c[0]`, first down the columns, then along the rows. So
/// `c[i] = (4 a[2i] - c[i - 1]) / 3`, in which errors shrink to a third at every step.
fn stored_chroma(pixels: &[[u8; 3]], channel: usize, width: usize, height: usize) -> Result<Image<u8>, Fault> {
    const FRACTION: i32 = 16;
    let half = Size::new(width.div_ceil(2), height.div_ceil(2));
    let mut column = vec![0i32; half.width];
    let mut stored = Vec::with_capacity(half.area());
    for (row, line) in pixels.chunks(2 * width).enumerate() {
        let mut left = 0;
        for (i, (above, pixel)) in column.iter_mut().zip(line.iter().take(width).step_by(2)).enumerate() {
            let sample = FRACTION * i32::from(pixel[channel]);
            *above = if row == 0 { sample } else { (4 * sample - *above) / 3 };
            left = if i == 0 { *above } else { (4 * *above - left) / 3 };
            stored.push(((left + FRACTION / 2) / FRACTION).clamp(0, 255) as u8);
        }
    }
    Ok(Image::from_vec(stored, half.width, half.height)?)
}

/// Motion JPEG may leave out the Huffman tables every decoder is supposed to know; puts them before the first scan.
fn with_huffman_tables<'a>(bytes: &'a [u8], scan: &JpegScan) -> Cow<'a, [u8]> {
    if scan.has_huffman_tables {
        return Cow::Borrowed(bytes);
    }
    let (head, tail) = bytes.split_at(scan.start_of_scan);
    Cow::Owned([head, &standard_tables(), tail].concat())
}

/// The typical tables of ITU-T T.81 annex K.3 as one DHT segment: luma DC, luma AC, chroma DC, chroma AC.
fn standard_tables() -> Vec<u8> {
    const DC_VALUES: [u8; 12] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11];
    const LUMA_DC: [u8; 16] = [0, 1, 5, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0];
    const CHROMA_DC: [u8; 16] = [0, 3, 1, 1, 1, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0];
    const LUMA_AC: [u8; 16] = [0, 2, 1, 3, 3, 2, 4, 3, 5, 5, 4, 4, 0, 0, 1, 0x7D];
    const CHROMA_AC: [u8; 16] = [0, 2, 1, 2, 4, 4, 3, 4, 7, 5, 4, 4, 0, 1, 2, 0x77];
    let mut segment = vec![0xFF, 0xC4, 0x01, 0xA2];
    let tables: [(u8, &[u8; 16], &[u8]); 4] = [
        (0x00, &LUMA_DC, &DC_VALUES),
        (0x10, &LUMA_AC, &LUMA_AC_VALUES),
        (0x01, &CHROMA_DC, &DC_VALUES),
        (0x11, &CHROMA_AC, &CHROMA_AC_VALUES),
    ];
    for (id, counts, values) in tables {
        segment.push(id);
        segment.extend_from_slice(counts);
        segment.extend_from_slice(values);
    }
    segment
}

/// ITU-T T.81 table K.5, run/size codes in order of increasing code length.
#[rustfmt::skip]
const LUMA_AC_VALUES: [u8; 162] = [
    0x01, 0x02, 0x03, 0x00, 0x04, 0x11, 0x05, 0x12, 0x21, 0x31, 0x41, 0x06, 0x13, 0x51, 0x61, 0x07, 0x22, 0x71,
    0x14, 0x32, 0x81, 0x91, 0xA1, 0x08, 0x23, 0x42, 0xB1, 0xC1, 0x15, 0x52, 0xD1, 0xF0, 0x24, 0x33, 0x62, 0x72,
    0x82, 0x09, 0x0A, 0x16, 0x17, 0x18, 0x19, 0x1A, 0x25, 0x26, 0x27, 0x28, 0x29, 0x2A, 0x34, 0x35, 0x36, 0x37,
    0x38, 0x39, 0x3A, 0x43, 0x44, 0x45, 0x46, 0x47, 0x48, 0x49, 0x4A, 0x53, 0x54, 0x55, 0x56, 0x57, 0x58, 0x59,
    0x5A, 0x63, 0x64, 0x65, 0x66, 0x67, 0x68, 0x69, 0x6A, 0x73, 0x74, 0x75, 0x76, 0x77, 0x78, 0x79, 0x7A, 0x83,
    0x84, 0x85, 0x86, 0x87, 0x88, 0x89, 0x8A, 0x92, 0x93, 0x94, 0x95, 0x96, 0x97, 0x98, 0x99, 0x9A, 0xA2, 0xA3,
    0xA4, 0xA5, 0xA6, 0xA7, 0xA8, 0xA9, 0xAA, 0xB2, 0xB3, 0xB4, 0xB5, 0xB6, 0xB7, 0xB8, 0xB9, 0xBA, 0xC2, 0xC3,
    0xC4, 0xC5, 0xC6, 0xC7, 0xC8, 0xC9, 0xCA, 0xD2, 0xD3, 0xD4, 0xD5, 0xD6, 0xD7, 0xD8, 0xD9, 0xDA, 0xE1, 0xE2,
    0xE3, 0xE4, 0xE5, 0xE6, 0xE7, 0xE8, 0xE9, 0xEA, 0xF1, 0xF2, 0xF3, 0xF4, 0xF5, 0xF6, 0xF7, 0xF8, 0xF9, 0xFA,
];

/// ITU-T T.81 table K.6.
#[rustfmt::skip]
const CHROMA_AC_VALUES: [u8; 162] = [
    0x00, 0x01, 0x02, 0x03, 0x11, 0x04, 0x05, 0x21, 0x31, 0x06, 0x12, 0x41, 0x51, 0x07, 0x61, 0x71, 0x13, 0x22,
    0x32, 0x81, 0x08, 0x14, 0x42, 0x91, 0xA1, 0xB1, 0xC1, 0x09, 0x23, 0x33, 0x52, 0xF0, 0x15, 0x62, 0x72, 0xD1,
    0x0A, 0x16, 0x24, 0x34, 0xE1, 0x25, 0xF1, 0x17, 0x18, 0x19, 0x1A, 0x26, 0x27, 0x28, 0x29, 0x2A, 0x35, 0x36,
    0x37, 0x38, 0x39, 0x3A, 0x43, 0x44, 0x45, 0x46, 0x47, 0x48, 0x49, 0x4A, 0x53, 0x54, 0x55, 0x56, 0x57, 0x58,
    0x59, 0x5A, 0x63, 0x64, 0x65, 0x66, 0x67, 0x68, 0x69, 0x6A, 0x73, 0x74, 0x75, 0x76, 0x77, 0x78, 0x79, 0x7A,
    0x82, 0x83, 0x84, 0x85, 0x86, 0x87, 0x88, 0x89, 0x8A, 0x92, 0x93, 0x94, 0x95, 0x96, 0x97, 0x98, 0x99, 0x9A,
    0xA2, 0xA3, 0xA4, 0xA5, 0xA6, 0xA7, 0xA8, 0xA9, 0xAA, 0xB2, 0xB3, 0xB4, 0xB5, 0xB6, 0xB7, 0xB8, 0xB9, 0xBA,
    0xC2, 0xC3, 0xC4, 0xC5, 0xC6, 0xC7, 0xC8, 0xC9, 0xCA, 0xD2, 0xD3, 0xD4, 0xD5, 0xD6, 0xD7, 0xD8, 0xD9, 0xDA,
    0xE2, 0xE3, 0xE4, 0xE5, 0xE6, 0xE7, 0xE8, 0xE9, 0xEA, 0xF2, 0xF3, 0xF4, 0xF5, 0xF6, 0xF7, 0xF8, 0xF9, 0xFA,
];
