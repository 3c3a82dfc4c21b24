use super::boxes::{child, full};
use crate::{ContainerError, Result};

/// Which part of the media is shown, and when (edit list, ISO/IEC 14496-12 §8.6.6).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Edits {
    segments: Vec<Segment>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Segment {
    media_start: i64,
    media_end: i64,
    /// When it starts, in media time units.
    shown_at: i64,
}

impl Edits {
    /// From a track's `edts`; `movie_scale` and `media_scale` are time units per second.
    pub(crate) fn read(trak: &[u8], movie_scale: u32, media_scale: u32) -> Result<Self> {
        let mut segments: Vec<Segment> = Vec::new();
        let Some((version, _, mut fields)) = child(trak, b"edts").and_then(|b| child(b, b"elst")).and_then(full) else {
            return Ok(Self::default());
        };
        let mut shown_at: i64 = 0;
        let count = fields.u32().unwrap_or(0);
        for _ in 0..count {
            let entry = match version {
                1 => fields.u64().zip(fields.u64().map(u64::cast_signed)),
                _ => fields.u32().map(u64::from).zip(fields.u32().map(|t| i64::from(t.cast_signed()))),
            };
            let Some(((duration, media_start), rate)) = entry.zip(fields.u32()) else { break };
            // Twelve days in nanoseconds fit; anything longer is as good as endless.
            let length = u128::from(duration) * u128::from(media_scale) / u128::from(movie_scale.max(1));
            let length = i64::try_from(length).unwrap_or(i64::MAX);
            if media_start >= 0 {
                let media_end = if length == 0 { i64::MAX } else { media_start.saturating_add(length) };
                if rate != 0x0001_0000 || segments.last().is_some_and(|s| media_start < s.media_end) {
                    return Err(ContainerError::unsupported("MP4 with an edit list that repeats, reverses or retimes"));
                }
                segments.push(Segment { media_start, media_end, shown_at });
            }
            shown_at = shown_at.saturating_add(length);
        }
        Ok(Self { segments })
    }

    /// When a sample of this composition time is shown, in media time units; `None` when it is cut away.
    pub fn shown_at(&self, composition_time: i64) -> Option<i64> {
        if self.segments.is_empty() {
            return Some(composition_time);
        }
        let inside = |s: &&Segment| (s.media_start..s.media_end).contains(&composition_time);
        let segment = self.segments.iter().find(inside)?;
        Some((composition_time - segment.media_start).saturating_add(segment.shown_at))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trak(entries: &[(u32, i32)]) -> Vec<u8> {
        let mut elst = vec![0, 0, 0, 0];
        elst.extend((entries.len() as u32).to_be_bytes());
        for &(duration, time) in entries {
            elst.extend(duration.to_be_bytes());
            elst.extend(time.to_be_bytes());
            elst.extend(0x0001_0000u32.to_be_bytes());
        }
        let boxed = |kind: &[u8], body: &[u8]| [&(body.len() as u32 + 8).to_be_bytes()[..], kind, body].concat();
        boxed(b"edts", &boxed(b"elst", &elst))
    }

    #[test]
    fn delays_cuts_and_joins() {
        // One second of nothing, media 1–2 s, media 3 s onwards; 1000 movie units and 30 media units a second.
        let edits = Edits::read(&trak(&[(1000, -1), (1000, 30), (0, 90)]), 1000, 30).unwrap();
        assert_eq!(edits.shown_at(29), None);
        assert_eq!(edits.shown_at(30), Some(30));
        assert_eq!(edits.shown_at(59), Some(59));
        assert_eq!(edits.shown_at(60), None);
        assert_eq!(edits.shown_at(90), Some(60));
        assert_eq!(Edits::default().shown_at(-7), Some(-7));
    }

    #[test]
    fn repeating_edits_are_left_to_others() {
        assert!(matches!(
            Edits::read(&trak(&[(1000, 30), (1000, 30)]), 1000, 30),
            Err(ContainerError::Unsupported { .. })
        ));
    }
}
