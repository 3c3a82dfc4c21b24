use super::Sample;
use super::boxes::{child, full};
use crate::bytes::Fields;
use crate::{ContainerError, Result};

/// More samples than this (38 hours at 30 frames per second) are refused: the index would not fit in memory sensibly.
pub(super) const MAX_SAMPLES: usize = 1 << 22;

/// The samples of a sample table, in decoding order.
pub(super) struct Expanded {
    pub samples: Vec<Sample>,
    /// When the last of them ends, in units of the track's time scale.
    pub end: u64,
    /// Where its tables do not go together.
    pub flaw: Option<String>,
}

/// Expands the tables of a sample table box (`stbl`, ISO/IEC 14496-12 §8.5–8.7) to one entry a sample, in decoding order.
pub(super) fn expand(stbl: &[u8], file_len: u64) -> Result<Expanded> {
    let sizes = Sizes::read(stbl).ok_or_else(|| ContainerError::malformed("its index has no sample sizes"))?;
    let chunks = ChunkOffsets::read(stbl).ok_or_else(|| ContainerError::malformed("its index has no chunk offsets"))?;
    let runs = table(stbl, b"stsc", 12).ok_or_else(|| ContainerError::malformed("its index has no chunk table"))?;
    let mut times = Times::new(table(stbl, b"stts", 8), table(stbl, b"ctts", 8));
    let count = sizes.count(file_len);
    if count > MAX_SAMPLES {
        return Err(ContainerError::malformed(format!(
            "its index lists {count} frames, more than {MAX_SAMPLES}; cut the file"
        )));
    }
    let mut samples = Vec::with_capacity(count);
    let mut runs = ChunkRuns::new(runs);
    for chunk in 0..chunks.len() {
        let per_chunk = runs.samples_in(chunk as u32 + 1)?;
        let mut offset = chunks.get(chunk).unwrap_or(u64::MAX);
        for _ in 0..per_chunk {
            if samples.len() == count {
                break;
            }
            let size = sizes.get(samples.len()).unwrap_or(0);
            samples.push(Sample { offset, size, composition_time: times.next() });
            offset = offset.saturating_add(u64::from(size));
        }
    }
    let (placed, listed, timed) = (samples.len() as u64, sizes.listed(), times.listed());
    let flaw = if placed != listed {
        Some(format!("its index lists {listed} frames and says where {placed} of them are"))
    } else {
        (timed != listed).then(|| format!("its index lists {listed} frames and has times for {timed}"))
    };
    Ok(Expanded { samples, end: times.decoding_time.max(0).cast_unsigned(), flaw })
}

/// The entries of a table box, cut to those that are really there.
fn table<'a>(stbl: &'a [u8], kind: &[u8; 4], entry_bytes: usize) -> Option<&'a [u8]> {
    let (_, _, mut fields) = full(child(stbl, kind)?)?;
    let count = fields.u32()? as usize;
    Some(&fields.0[..count.saturating_mul(entry_bytes).min(fields.0.len() / entry_bytes * entry_bytes)])
}

/// Sample sizes (`stsz`, `stz2`).
enum Sizes<'a> {
    Constant { size: u32, count: u32 },
    Table { bytes: &'a [u8], bits: u32, count: usize },
}

impl<'a> Sizes<'a> {
    fn read(stbl: &'a [u8]) -> Option<Self> {
        if let Some(body) = child(stbl, b"stsz") {
            let (_, _, mut fields) = full(body)?;
            let (size, count) = (fields.u32()?, fields.u32()?);
            return Some(match size {
                0 => Self::Table { bytes: fields.0, bits: 32, count: (count as usize).min(fields.0.len() / 4) },
                _ => Self::Constant { size, count },
            });
        }
        let (_, _, mut fields) = full(child(stbl, b"stz2")?)?;
        let (bits, count) = (fields.u32()? & 0xFF, fields.u32()? as usize);
        let bytes = fields.0;
        matches!(bits, 4 | 8 | 16).then(|| Self::Table {
            bytes,
            bits,
            count: count.min(bytes.len().saturating_mul(8) / bits as usize),
        })
    }

    /// How many there are said to be.
    fn listed(&self) -> u64 {
        match *self {
            Self::Constant { count, .. } => count.into(),
            Self::Table { count, .. } => count as u64,
        }
    }

    /// A constant size is believed only as often as it fits into the file.
    fn count(&self, file_len: u64) -> usize {
        match *self {
            Self::Constant { size, count } => u64::from(count).min(file_len / u64::from(size).max(1)) as usize,
            Self::Table { count, .. } => count,
        }
    }

    fn get(&self, index: usize) -> Option<u32> {
        match *self {
            Self::Constant { size, .. } => Some(size),
            Self::Table { bytes, bits, .. } => match bits {
                4 => {
                    let byte = u32::from(*bytes.get(index / 2)?);
                    Some(if index.is_multiple_of(2) { byte >> 4 } else { byte & 15 })
                }
                8 => bytes.get(index).map(|&b| u32::from(b)),
                16 => bytes.as_chunks::<2>().0.get(index).map(|&b| u32::from(u16::from_be_bytes(b))),
                _ => bytes.as_chunks::<4>().0.get(index).map(|&b| u32::from_be_bytes(b)),
            },
        }
    }
}

/// Chunk offsets of 32 or 64 bits (`stco`, `co64`).
enum ChunkOffsets<'a> {
    Short(&'a [[u8; 4]]),
    Long(&'a [[u8; 8]]),
}

impl<'a> ChunkOffsets<'a> {
    fn read(stbl: &'a [u8]) -> Option<Self> {
        let short = table(stbl, b"stco", 4).map(|t| Self::Short(t.as_chunks().0));
        short.or_else(|| table(stbl, b"co64", 8).map(|t| Self::Long(t.as_chunks().0)))
    }

    const fn len(&self) -> usize {
        match self {
            Self::Short(t) => t.len(),
            Self::Long(t) => t.len(),
        }
    }

    fn get(&self, index: usize) -> Option<u64> {
        match self {
            Self::Short(t) => t.get(index).map(|&b| u64::from(u32::from_be_bytes(b))),
            Self::Long(t) => t.get(index).map(|&b| u64::from_be_bytes(b)),
        }
    }
}

/// Samples per chunk (`stsc`), asked for chunk after chunk.
struct ChunkRuns<'a> {
    entries: Fields<'a>,
    current: u32,
    next: Option<(u32, u32, u32)>,
}

impl<'a> ChunkRuns<'a> {
    fn new(entries: &'a [u8]) -> Self {
        let mut runs = Self { entries: Fields(entries), current: 0, next: None };
        runs.next = runs.read();
        runs
    }

    fn read(&mut self) -> Option<(u32, u32, u32)> {
        Some((self.entries.u32()?, self.entries.u32()?, self.entries.u32()?))
    }

    fn samples_in(&mut self, chunk: u32) -> Result<u32> {
        while let Some((first, per_chunk, description)) = self.next.filter(|run| run.0 <= chunk) {
            if description > 1 {
                return Err(ContainerError::unsupported(format!("MP4 that changes its coding at chunk {first}")));
            }
            self.current = per_chunk;
            self.next = self.read();
        }
        Ok(self.current)
    }
}

/// Composition times from decoding times (`stts`) and offsets (`ctts`), asked for sample after sample.
struct Times<'a> {
    /// The whole of `stts`.
    table: &'a [u8],
    durations: Runs<'a>,
    offsets: Runs<'a>,
    decoding_time: i64,
}

impl<'a> Times<'a> {
    fn new(stts: Option<&'a [u8]>, ctts: Option<&'a [u8]>) -> Self {
        let runs = |table: Option<&'a [u8]>| Runs { entries: Fields(table.unwrap_or_default()), left: 0, value: 0 };
        Self { table: stts.unwrap_or_default(), durations: runs(stts), offsets: runs(ctts), decoding_time: 0 }
    }

    /// How many samples have times of their own.
    fn listed(&self) -> u64 {
        self.table.as_chunks::<8>().0.iter().map(|entry| u64::from(Fields(entry).u32().unwrap_or_default())).sum()
    }

    fn next(&mut self) -> i64 {
        // Offsets of version 0 are unsigned by the letter, but writers store negative ones there too.
        let time = self.decoding_time + i64::from(self.offsets.next().cast_signed());
        self.decoding_time += i64::from(self.durations.next());
        time
    }
}

/// A table of (count, value) runs; after its end the last value holds.
struct Runs<'a> {
    entries: Fields<'a>,
    left: u32,
    value: u32,
}

impl Runs<'_> {
    fn next(&mut self) -> u32 {
        while self.left == 0 {
            let Some((count, value)) = self.entries.u32().zip(self.entries.u32()) else { return self.value };
            (self.left, self.value) = (count, value);
        }
        self.left -= 1;
        self.value
    }
}
