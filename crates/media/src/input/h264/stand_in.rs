//! A picture in the place of one that is damaged: the one before it, repeated. So the pictures that refer to the missing one
//! find one of its number, and the decoder's account of them stays in order.

use super::bits::{BitWriter, Bits};
use super::sequence::{PictureOrder, Sequence};
use super::units::{self, content};

/// What the slices of a picture say of its place among the others (ITU-T H.264 §7.3.3).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Place {
    /// Counts the pictures that others refer to.
    frame_num: u32,
    /// The low bits of its place in the order of display, where the stream says it.
    order: u32,
    /// Whether others may refer to it.
    pub is_reference: bool,
}

impl Place {
    /// Of the picture that this unit begins; `None` for other units and where the bits make no sense.
    pub fn read(unit: &[u8], sequence: &Sequence) -> Option<Self> {
        let is_refresh = units::kind(unit) == units::REFRESH_SLICE;
        if !is_refresh && units::kind(unit) != units::SLICE {
            return None;
        }
        let content = content(unit, 32);
        let mut bits = Bits::new(&content);
        let (first_macroblock, kind, parameters) = (bits.exp_golomb()?, bits.exp_golomb()?, bits.exp_golomb()?);
        if first_macroblock != 0 || kind > 9 || parameters > 255 {
            return None;
        }
        let frame_num = bits.unsigned(sequence.frame_num_bits)?;
        if is_refresh {
            bits.exp_golomb()?;
        }
        let order = match sequence.order {
            PictureOrder::Said { bits: width } => bits.unsigned(width)?,
            PictureOrder::Cyclic { .. } | PictureOrder::AsDecoded => 0,
        };
        Some(Self { frame_num, order, is_reference: unit.first().is_some_and(|byte| byte >> 5 & 3 != 0) })
    }

    /// Of the picture after this one, which others refer to, as far as can be told without it.
    fn next(self, sequence: &Sequence) -> Self {
        let order = match sequence.order {
            PictureOrder::Said { bits } => (self.order + 2) & ((1 << bits) - 1),
            PictureOrder::Cyclic { .. } | PictureOrder::AsDecoded => 0,
        };
        let frame_num = (self.frame_num + 1) & ((1 << sequence.frame_num_bits) - 1);
        Self { frame_num, order, is_reference: true }
    }

    /// Of a damaged picture, by what its first unit says where that is plausible, after the reference picture `before` it.
    pub fn of_damaged(unit: Option<&[u8]>, before: Self, sequence: &Sequence) -> Self {
        let expected = before.next(sequence);
        let said = unit.and_then(|unit| Self::read(unit, sequence));
        said.filter(|place| place.frame_num == expected.frame_num).unwrap_or(expected)
    }
}

/// Picture parameters that no stream uses.
const PARAMETERS: u32 = 255;

/// The picture before, repeated at this place, as a stream with its own parameters; `None` where pictures may be fields.
pub(super) fn stand_in(place: Place, sequence: &Sequence) -> Option<Vec<u8>> {
    if !sequence.frames_only {
        return None;
    }
    let mut out = Vec::new();
    // Coded by lengths; one reference; no weights; the filter at edges can be switched off (ITU-T H.264 §7.3.2.2).
    let mut set = BitWriter::default();
    set.exp_golomb(PARAMETERS);
    set.exp_golomb(sequence.id);
    set.unsigned(0, 2);
    (0..3).for_each(|_| set.exp_golomb(0));
    set.unsigned(0, 3);
    (0..3).for_each(|_| set.exp_golomb(0));
    set.unsigned(0b100, 3);
    units::push_with_start_code(&set.unit(0x68), &mut out);
    // A slice of predicted macroblocks, all skipped (§7.3.3, §7.3.4).
    let mut slice = BitWriter::default();
    slice.exp_golomb(0);
    slice.exp_golomb(5);
    slice.exp_golomb(PARAMETERS);
    slice.unsigned(place.frame_num, sequence.frame_num_bits);
    match sequence.order {
        PictureOrder::Said { bits } => slice.unsigned(place.order, bits),
        PictureOrder::Cyclic { has_deltas: true } => slice.exp_golomb(0),
        PictureOrder::Cyclic { has_deltas: false } | PictureOrder::AsDecoded => {}
    }
    // The usual number of references in the usual order, and the usual ones are kept.
    slice.unsigned(0, 3);
    slice.exp_golomb(0);
    slice.exp_golomb(1);
    slice.exp_golomb(u32::try_from(sequence.macroblocks).ok()?);
    units::push_with_start_code(&slice.unit(0x41), &mut out);
    Some(out)
}
