//! What a file says of its own length, held against what its index gives.

use super::boxes::{child, full};

/// How much shorter or longer than it says a sound file may be, seconds.
const TOLERANCE_S: f64 = 0.5;
/// The same as a part of its length.
const TOLERANCE: f64 = 0.02;

/// The duration in `mvhd`, `mdhd`: units of its own time scale; none where it is unknown (all ones) or zero.
pub(super) fn duration_of(header: &[u8]) -> Option<u64> {
    let (version, _, mut fields) = full(header)?;
    fields.skip(if version == 1 { 16 } else { 8 } + 4)?;
    known(version, &mut fields)
}

/// The duration of all fragments (`mehd` in `mvex`), in units of the movie's time scale.
pub(super) fn fragments_duration(moov: &[u8]) -> Option<u64> {
    let (version, _, mut fields) = full(child(child(moov, b"mvex")?, b"mehd")?)?;
    known(version, &mut fields)
}

fn known(version: u8, fields: &mut crate::bytes::Fields<'_>) -> Option<u64> {
    let (value, unknown) = match version {
        1 => (fields.u64()?, u64::MAX),
        _ => (u64::from(fields.u32()?), u64::from(u32::MAX)),
    };
    (value != 0 && value != unknown).then_some(value)
}

/// Where a segment index (`sidx`, ISO/IEC 14496-12 §8.16.3) says that its segments end, in seconds.
pub(super) fn indexed_end_s(sidx: &[u8], track_id: u32) -> Option<f64> {
    let (version, _, mut fields) = full(sidx)?;
    let (id, scale) = (fields.u32()?, fields.u32()?);
    let begin = if version == 0 { u64::from(fields.u32()?) } else { fields.u64()? };
    fields.skip(if version == 0 { 4 } else { 8 } + 2)?;
    let mut end = begin;
    for _ in 0..fields.u16()? {
        let (_size, duration, _access) = (fields.u32()?, fields.u32()?, fields.u32()?);
        end = end.saturating_add(u64::from(duration));
    }
    (id == track_id && scale > 0).then(|| end as f64 / f64::from(scale))
}

/// What is wrong when a file says that it is `said_s` seconds long and its frames are for `found_s`; frames may be missing,
/// or their times be damaged.
pub(super) fn compare(said_s: f64, found_s: f64) -> Option<String> {
    let apart = (said_s - found_s).abs() > TOLERANCE_S.max(TOLERANCE * said_s);
    apart.then(|| format!("the file says that it is {said_s:.2} s long, and has frames for {found_s:.2} s"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_read_where_they_are_known() {
        let header = |version: u8, fields: &[u8]| [&[version, 0, 0, 0], fields].concat();
        let short = |duration: u32| header(0, &[&[0; 8][..], &[0, 0, 3, 232], &duration.to_be_bytes()].concat());
        let long = |duration: u64| header(1, &[&[0; 16][..], &[0, 0, 3, 232], &duration.to_be_bytes()].concat());
        assert_eq!((duration_of(&short(77)), duration_of(&long(78))), (Some(77), Some(78)));
        assert_eq!(
            (duration_of(&short(0)), duration_of(&short(u32::MAX)), duration_of(&long(u64::MAX))),
            (None, None, None)
        );
        assert_eq!(duration_of(&short(77)[..19]), None);
    }

    #[test]
    fn a_segment_index_ends_where_its_segments_do() {
        let segment = |duration: u32| [&[0, 0, 1, 0][..], &duration.to_be_bytes(), &[0; 4]].concat();
        let words = |numbers: &[u32]| numbers.iter().flat_map(|n| n.to_be_bytes()).collect::<Vec<_>>();
        let index = [words(&[0, 7, 1000, 500, 0]), vec![0, 0, 0, 2], segment(2000), segment(1500)].concat();
        assert_eq!((indexed_end_s(&index, 7), indexed_end_s(&index, 8)), (Some(4.0), None));
        assert_eq!(indexed_end_s(&index[..40], 7), None);
    }

    #[test]
    fn small_differences_of_length_are_tolerated() {
        assert_eq!((compare(10.0, 9.6), compare(100.0, 98.1), compare(100.0, 101.9)), (None, None, None));
        assert!(compare(10.0, 9.4).unwrap().contains("10.00 s long, and has frames for 9.40 s"));
        assert!(compare(100.0, 97.9).is_some() && compare(100.0, 102.1).is_some());
    }
}
