use super::Sample;
use super::boxes::{child, children, full};
use super::samples::MAX_SAMPLES;
use crate::bytes::Fields;
use crate::{ContainerError, Result};

/// What a fragment's samples have in common unless it says otherwise (`trex`, `tfhd`).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Defaults {
    duration: u32,
    size: u32,
}

impl Defaults {
    /// Of one track, from the movie's `mvex`.
    pub fn read(moov: &[u8], track_id: u32) -> Option<Self> {
        children(child(moov, b"mvex")?).filter(|(kind, _)| kind == b"trex").find_map(|(_, body)| {
            let (_, _, mut fields) = full(body)?;
            let id = fields.u32()?;
            let _description = fields.u32()?;
            let defaults = Self { duration: fields.u32()?, size: fields.u32()? };
            (id == track_id).then_some(defaults)
        })
    }
}

/// Collects the samples of one track from movie fragments (ISO/IEC 14496-12 §8.8), in decoding order.
pub(super) struct Fragments {
    pub track_id: u32,
    pub defaults: Defaults,
    pub samples: Vec<Sample>,
    pub file_len: u64,
    pub decoding_time: i64,
}

/// Where the next run's data lies, and what its samples have in common.
struct RunPosition {
    defaults: Defaults,
    base: u64,
    data: u64,
}

impl Fragments {
    /// Adds one `moof` that begins at byte `start` of the file.
    pub fn add(&mut self, moof: &[u8], start: u64) -> Result<()> {
        // Without flags a track's data begins where that of the track before it ended.
        let mut previous_end = start;
        for (_, traf) in children(moof).filter(|(kind, _)| kind == b"traf") {
            if let Some(end) = self.add_track(traf, start, previous_end)? {
                previous_end = end;
            }
        }
        Ok(())
    }

    fn add_track(&mut self, traf: &[u8], moof_start: u64, previous_end: u64) -> Result<Option<u64>> {
        let Some((id, mut place)) = child(traf, b"tfhd").and_then(|b| self.place(b, moof_start, previous_end)) else {
            return Ok(None);
        };
        let ours = id == self.track_id;
        if ours && let Some(time) = child(traf, b"tfdt").and_then(base_time) {
            self.decoding_time = time;
        }
        for (_, trun) in children(traf).filter(|(kind, _)| kind == b"trun") {
            self.add_run(trun, ours, &mut place)?;
        }
        Ok(Some(place.data))
    }

    fn place(&self, tfhd: &[u8], moof_start: u64, previous_end: u64) -> Option<(u32, RunPosition)> {
        let (_, flags, mut fields) = full(tfhd)?;
        let id = fields.u32()?;
        let mut defaults = self.defaults;
        let mut base = if flags & 0x02_0000 != 0 { moof_start } else { previous_end };
        if flags & 0x01 != 0 {
            base = fields.u64()?;
        }
        if flags & 0x02 != 0 && fields.u32()? > 1 {
            return None;
        }
        if flags & 0x08 != 0 {
            defaults.duration = fields.u32()?;
        }
        if flags & 0x10 != 0 {
            defaults.size = fields.u32()?;
        }
        Some((id, RunPosition { defaults, base, data: base }))
    }

    fn add_run(&mut self, trun: &[u8], ours: bool, place: &mut RunPosition) -> Result<()> {
        let Some((_, flags, mut fields)) = full(trun) else { return Ok(()) };
        let Some(count) = fields.u32() else { return Ok(()) };
        if flags & 0x01 != 0 {
            let Some(offset) = fields.u32() else { return Ok(()) };
            place.data = place.base.saturating_add_signed(i64::from(offset.cast_signed()));
        }
        if flags & 0x04 != 0 {
            fields.u32();
        }
        let field_bytes = 4 * (flags & 0x0F00).count_ones();
        if field_bytes == 0 && u64::from(count) * u64::from(place.defaults.size.max(1)) > self.file_len {
            return Err(ContainerError::malformed("a fragment lists more data than the file has"));
        }
        for _ in 0..count {
            let Some(entry) = Entry::read(&mut fields, flags, place.defaults) else { break };
            if ours {
                if self.samples.len() == MAX_SAMPLES {
                    return Err(ContainerError::malformed(format!(
                        "it has more than {MAX_SAMPLES} frames; cut the file"
                    )));
                }
                let composition_time = self.decoding_time.saturating_add(i64::from(entry.offset));
                self.samples.push(Sample { offset: place.data, size: entry.size, composition_time });
                self.decoding_time = self.decoding_time.saturating_add(i64::from(entry.duration));
            }
            place.data = place.data.saturating_add(u64::from(entry.size));
        }
        Ok(())
    }
}

/// One sample of a run.
struct Entry {
    duration: u32,
    size: u32,
    offset: i32,
}

impl Entry {
    fn read(fields: &mut Fields<'_>, flags: u32, defaults: Defaults) -> Option<Self> {
        let mut field = |flag: u32| if flags & flag != 0 { fields.u32().map(Some) } else { Some(None) };
        let (duration, size, _flags, offset) = (field(0x100)?, field(0x200)?, field(0x400)?, field(0x800)?);
        Some(Self {
            duration: duration.unwrap_or(defaults.duration),
            size: size.unwrap_or(defaults.size),
            offset: offset.unwrap_or(0).cast_signed(),
        })
    }
}

fn base_time(tfdt: &[u8]) -> Option<i64> {
    let (version, _, mut fields) = full(tfdt)?;
    let time = if version == 1 { fields.u64()? } else { u64::from(fields.u32()?) };
    i64::try_from(time).ok()
}
