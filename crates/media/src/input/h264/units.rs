use super::bits::Bits;

/// A coded slice of a picture that is no instantaneous refresh (ITU-T H.264 table 7-1).
pub(super) const SLICE: u8 = 1;
/// A coded slice of an instantaneous decoder refresh picture.
pub(super) const REFRESH_SLICE: u8 = 5;
/// A sequence parameter set.
pub(super) const SEQUENCE_PARAMETERS: u8 = 7;

/// A picture parameter set.
const PICTURE_PARAMETERS: u8 = 8;

/// Whether a unit is a picture parameter set, and whether pictures by it are coded arithmetically (ITU-T H.264 §7.3.2.2:
/// `entropy_coding_mode_flag`); `None` for other units.
pub(super) fn is_arithmetic(unit: &[u8]) -> Option<bool> {
    let content = (kind(unit) == PICTURE_PARAMETERS).then(|| content(unit, 16))?;
    let mut bits = Bits::new(&content);
    let (_picture, _sequence) = (bits.exp_golomb()?, bits.exp_golomb()?);
    bits.flag()
}

/// The units of a sample, each after a big-endian length of `length_bytes` (ISO/IEC 14496-15 §5.3.4.2); ends at the first
/// that does not fit.
pub(super) fn units(sample: &[u8], length_bytes: usize) -> impl Iterator<Item = &[u8]> {
    let mut rest = sample;
    std::iter::from_fn(move || {
        let (length, tail) = rest.split_at_checked(length_bytes)?;
        let length = length.iter().fold(0, |value, &byte| value << 8 | usize::from(byte));
        let (unit, tail) = tail.split_at_checked(length)?;
        rest = tail;
        Some(unit)
    })
    .filter(|unit| !unit.is_empty())
}

/// Whether the units fill the sample to its end, as they must.
pub(super) fn are_whole(sample: &[u8], length_bytes: usize) -> bool {
    let mut rest = sample;
    while !rest.is_empty() {
        let Some((length, tail)) = rest.split_at_checked(length_bytes) else { return false };
        let length = length.iter().fold(0, |value, &byte| value << 8 | usize::from(byte));
        let Some((_, tail)) = tail.split_at_checked(length) else { return false };
        rest = tail;
    }
    true
}

/// The type of a unit.
pub(super) fn kind(unit: &[u8]) -> u8 {
    unit.first().map_or(0, |b| b & 31)
}

/// Whether a unit holds part of a picture.
pub(super) fn is_slice(unit: &[u8]) -> bool {
    matches!(kind(unit), SLICE..=REFRESH_SLICE)
}

/// Appends a unit with the start code decoders want.
pub(super) fn push_with_start_code(unit: &[u8], out: &mut Vec<u8>) {
    out.extend_from_slice(&[0, 0, 0, 1]);
    out.extend_from_slice(unit);
}

/// The content of a unit without emulation prevention (ITU-T H.264 §7.4.1.1), at most `limit` bytes of it.
pub(super) fn content(unit: &[u8], limit: usize) -> Vec<u8> {
    let mut out = Vec::with_capacity(unit.len().min(limit));
    let mut zeros = 0;
    for &byte in unit.iter().skip(1) {
        if out.len() == limit {
            break;
        }
        if zeros >= 2 && byte == 3 {
            zeros = 0;
            continue;
        }
        zeros = if byte == 0 { zeros + 1 } else { 0 };
        out.push(byte);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_end_where_they_no_longer_fit() {
        let sample = [0, 2, 0x65, 9, 0, 0, 0, 1, 0x41, 0, 9, 1];
        assert_eq!(units(&sample, 2).collect::<Vec<_>>(), [&[0x65, 9][..], &[0x41][..]]);
        assert!(!are_whole(&sample, 2) && are_whole(&sample[..9], 2) && !are_whole(&sample[..10], 2));
    }

    #[test]
    fn the_coding_is_told_by_the_picture_parameters() {
        // Both numbers 0, then the flag; numbers 1 and 2, then the flag.
        assert_eq!(
            (is_arithmetic(&[0x68, 0b1110_0000]), is_arithmetic(&[0x68, 0b1100_0000])),
            (Some(true), Some(false))
        );
        assert_eq!(is_arithmetic(&[0x68, 0b0100_1110]), Some(true));
        assert_eq!((is_arithmetic(&[0x68]), is_arithmetic(&[0x67, 0b1110_0000])), (None, None));
    }

    #[test]
    fn emulation_prevention_is_taken_out() {
        assert_eq!(content(&[0x67, 1, 0, 0, 3, 1, 0, 0, 3], 99), [1, 0, 0, 1, 0, 0]);
    }
}
