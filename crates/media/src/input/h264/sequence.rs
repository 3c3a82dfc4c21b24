use super::bits::Bits;
use super::units::content;
use crate::input::color::{ColorInfo, matrix_of_code};
use crate::input::fault::Fault;
use crate::input::limits::check_size;
use pursuit_geometry::Size;
use pursuit_imaging::ColorRange;

/// What a sequence parameter set says about pictures (ITU-T H.264 §7.3.2.1.1 and annex E).
///
/// Read here although the decoder reads it too: to refuse what it cannot do before the first frame, to know the colours,
/// which it does not report, and to keep absurd values from it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sequence {
    /// Its number.
    pub id: u32,
    /// How many bits a picture's number takes.
    pub frame_num_bits: u32,
    pub order: PictureOrder,
    /// Whether all pictures are frames, and none are fields.
    pub frames_only: bool,
    /// Macroblocks of a picture.
    pub macroblocks: usize,
    /// Pixels cut off on the left and on the top.
    pub crop_origin: (usize, usize),
    /// Width and height that are shown.
    pub size: Size,
    pub color: ColorInfo,
    /// Width against height of a pixel, where it says so.
    pub pixel_aspect: Option<(u32, u32)>,
}

/// How the place of pictures in the order of display is told (ITU-T H.264 §8.2.1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum PictureOrder {
    /// Each picture says the low bits of it.
    Said { bits: u32 },
    /// By cycles, to which pictures may add.
    Cyclic { has_deltas: bool },
    /// As they are decoded.
    AsDecoded,
}

/// Profiles whose parameter sets carry chroma format and bit depth (ITU-T H.264 §7.3.2.1.1).
const HIGH_PROFILES: [u32; 13] = [100, 110, 122, 244, 44, 83, 86, 118, 128, 138, 139, 134, 135];

/// Macroblocks a decoder may have to keep for reference: level 6.2, the largest there is (ITU-T H.264 table A-1).
pub(super) const MAX_BUFFERED_MACROBLOCKS: usize = 696_320;

impl Sequence {
    /// Reads a unit of type 7.
    pub fn read(unit: &[u8]) -> Result<Self, Fault> {
        let bytes = content(unit, 1 << 12);
        let mut bits = Bits::new(&bytes);
        sequence(&mut bits).unwrap_or_else(|| Err(Fault::malformed("its H.264 parameters are damaged")))
    }
}

/// `None` where the bits end early.
fn sequence(bits: &mut Bits<'_>) -> Option<Result<Sequence, Fault>> {
    let profile = bits.unsigned(8)?;
    bits.unsigned(16)?;
    let id = bits.exp_golomb()?;
    if HIGH_PROFILES.contains(&profile)
        && let Some(feature) = high_profile_fields(bits)?
    {
        return Some(Err(Fault::unsupported(format!("H.264 {feature}"))));
    }
    let frame_num_bits = bits.exp_golomb()?.saturating_add(4);
    let order = picture_order(bits)?;
    let references = u64::from(bits.exp_golomb()?);
    let (Some(order), 4..=16, 0..=16) = (order, frame_num_bits, references) else {
        return Some(Err(Fault::malformed("its H.264 parameters are out of range")));
    };
    bits.flag()?;
    let width = (u64::from(bits.exp_golomb()?) + 1) * 16;
    let map_height = (u64::from(bits.exp_golomb()?) + 1) * 16;
    let frames_only = bits.flag()?;
    let height = if frames_only { map_height } else { 2 * map_height };
    if !frames_only && bits.flag()? {
        return Some(Err(Fault::unsupported("H.264 interlaced (MBAFF)")));
    }
    bits.flag()?;
    let coded = match check_size(width, height) {
        Ok(size) => size,
        Err(fault) => return Some(Err(fault)),
    };
    let macroblocks = coded.area() / 256;
    if macroblocks as u64 * references.max(1) > MAX_BUFFERED_MACROBLOCKS as u64 {
        return Some(Err(Fault::unsupported("H.264 that asks for more picture memory than level 6.2 allows")));
    }
    let crop = if bits.flag()? {
        [bits.exp_golomb()?, bits.exp_golomb()?, bits.exp_golomb()?, bits.exp_golomb()?].map(u64::from)
    } else {
        [0; 4]
    };
    // Units of one chroma sample: 2 pixels, and 4 rows where there may be fields.
    let unit_y = if frames_only { 2 } else { 4 };
    let [left, right, top, bottom] = [2 * crop[0], 2 * crop[1], unit_y * crop[2], unit_y * crop[3]];
    if left + right >= width || top + bottom >= height {
        return Some(Err(Fault::malformed("its H.264 picture is cropped to nothing")));
    }
    let size = Size::new((width - left - right) as usize, (height - top - bottom) as usize);
    let described = bits.flag()?;
    let pixel_aspect = if described { usability_aspect(bits).flatten() } else { None };
    let color = if described { usability_color(bits).unwrap_or_default() } else { ColorInfo::default() };
    let crop_origin = (left as usize, top as usize);
    Some(Ok(Sequence { id, frame_num_bits, order, frames_only, macroblocks, crop_origin, size, color, pixel_aspect }))
}

/// Skips what high profiles add; names the feature when the decoder cannot do it.
fn high_profile_fields(bits: &mut Bits<'_>) -> Option<Option<&'static str>> {
    match bits.exp_golomb()? {
        1 => {}
        0 => return Some(Some("monochrome (4:0:0)")),
        2 => return Some(Some("4:2:2")),
        3 => return Some(Some("4:4:4")),
        _ => return None,
    }
    if bits.exp_golomb()? != 0 || bits.exp_golomb()? != 0 {
        return Some(Some("with more than 8 bits"));
    }
    bits.flag()?;
    if bits.flag()? {
        for list in 0..8 {
            if bits.flag()? {
                skip_scaling_list(bits, if list < 6 { 16 } else { 64 })?;
            }
        }
    }
    Some(None)
}

fn skip_scaling_list(bits: &mut Bits<'_>, size: usize) -> Option<()> {
    let (mut last, mut next) = (8i64, 8i64);
    for _ in 0..size {
        if next != 0 {
            let delta = bits.signed_exp_golomb()?;
            if !(-128..=127).contains(&delta) {
                return None;
            }
            next = (last + delta).rem_euclid(256);
        }
        last = if next == 0 { last } else { next };
    }
    Some(())
}

/// How the order of display is told; the inner `None` where a field is out of range.
fn picture_order(bits: &mut Bits<'_>) -> Option<Option<PictureOrder>> {
    Some(match bits.exp_golomb()? {
        0 => Some(bits.exp_golomb()?).filter(|n| *n <= 12).map(|n| PictureOrder::Said { bits: n + 4 }),
        1 => {
            let always_zero = bits.flag()?;
            bits.signed_exp_golomb()?;
            bits.signed_exp_golomb()?;
            let cycle = bits.exp_golomb()?;
            for _ in 0..cycle.min(256) {
                bits.signed_exp_golomb()?;
            }
            (cycle < 256).then_some(PictureOrder::Cyclic { has_deltas: !always_zero })
        }
        kind => (kind == 2).then_some(PictureOrder::AsDecoded),
    })
}

/// `sample_aspect_ratio` of indices 1 to 16 (ITU-T H.264 table E-1).
const ASPECTS: [(u32, u32); 16] = [
    (1, 1),
    (12, 11),
    (10, 11),
    (16, 11),
    (40, 33),
    (24, 11),
    (20, 11),
    (32, 11),
    (80, 33),
    (18, 11),
    (15, 11),
    (64, 33),
    (160, 99),
    (4, 3),
    (3, 2),
    (2, 1),
];

/// Width against height of a pixel, which come first in the video usability information; `None` where the bits end early.
fn usability_aspect(bits: &mut Bits<'_>) -> Option<Option<(u32, u32)>> {
    if !bits.flag()? {
        return Some(None);
    }
    Some(match bits.unsigned(8)? {
        255 => Some((bits.unsigned(16)?, bits.unsigned(16)?)).filter(|&(w, h)| w > 0 && h > 0),
        index => (index as usize).checked_sub(1).and_then(|at| ASPECTS.get(at)).copied(),
    })
}

/// Range and matrix from what follows them (ITU-T H.264 annex E.1.1).
fn usability_color(bits: &mut Bits<'_>) -> Option<ColorInfo> {
    if bits.flag()? {
        bits.flag()?; // overscan
    }
    if !bits.flag()? {
        return None;
    }
    bits.unsigned(3)?;
    let range = Some(if bits.flag()? { ColorRange::Full } else { ColorRange::Limited });
    let described = bits.flag()?;
    let matrix = if described { matrix_of_code((bits.unsigned(24)? & 0xFF) as u8) } else { None };
    Some(ColorInfo { matrix, range })
}
