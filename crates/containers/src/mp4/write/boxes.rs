//! The boxes of a fragmented MP4 file with one H.264 track (ISO/IEC 14496-12 and -15). Written by hand: there are few, and
//! a general muxer keeps an index of all fragments in hand and copies it for each.

/// Ticks per second of all times in the file.
pub(super) const TIMESCALE: u32 = 90_000;

/// One sample of a fragment.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    /// How long it is shown, in ticks.
    pub(super) duration: u32,
    /// Bytes.
    pub(super) size: u32,
    /// Whether decoding can begin here.
    pub(super) keyframe: bool,
}

/// A fragment from which decoding can begin: its time in ticks and where in the file it is.
#[derive(Debug, Clone, Copy)]
pub(super) struct EntryPoint {
    pub(super) time: u64,
    pub(super) offset: u64,
}

/// Appends a box: its length, its type, and what `body` writes.
fn boxed(out: &mut Vec<u8>, kind: &[u8; 4], body: impl FnOnce(&mut Vec<u8>)) {
    let start = out.len();
    out.extend_from_slice(&[0; 4]);
    out.extend_from_slice(kind);
    body(out);
    let length = (out.len() - start) as u32;
    out[start..start + 4].copy_from_slice(&length.to_be_bytes());
}

/// A box with version and flags.
fn full(out: &mut Vec<u8>, kind: &[u8; 4], version: u8, flags: u32, body: impl FnOnce(&mut Vec<u8>)) {
    boxed(out, kind, |out| {
        put32(out, &[u32::from(version) << 24 | flags]);
        body(out);
    });
}

fn put16(out: &mut Vec<u8>, values: &[u16]) {
    values.iter().for_each(|v| out.extend_from_slice(&v.to_be_bytes()));
}

fn put32(out: &mut Vec<u8>, values: &[u32]) {
    values.iter().for_each(|v| out.extend_from_slice(&v.to_be_bytes()));
}

fn put64(out: &mut Vec<u8>, values: &[u64]) {
    values.iter().for_each(|v| out.extend_from_slice(&v.to_be_bytes()));
}

/// The unit transformation, in the formats of its entries.
const MATRIX: [u32; 9] = [0x1_0000, 0, 0, 0, 0x1_0000, 0, 0, 0, 0x4000_0000];

/// What the header says of the track.
pub(super) struct Track<'a> {
    pub(super) width: u16,
    pub(super) height: u16,
    /// Width against height of a pixel.
    pub(super) pixel_aspect: Option<(u32, u32)>,
    /// Sequence and picture parameter set.
    pub(super) sequence: &'a [u8],
    pub(super) pictures: &'a [u8],
}

/// `ftyp` and `moov`, and the place in them that [`duration`] can later fill.
pub(super) fn header(track: &Track<'_>) -> (Vec<u8>, u64) {
    let mut out = Vec::with_capacity(1024);
    boxed(&mut out, b"ftyp", |out| {
        out.extend_from_slice(b"iso5");
        put32(out, &[512]);
        out.extend_from_slice(b"iso5iso6mp41avc1");
    });
    let mut reserved = 0;
    boxed(&mut out, b"moov", |out| {
        // Durations are 0: the movie's samples are in its fragments.
        full(out, b"mvhd", 0, 0, |out| {
            put32(out, &[0, 0, TIMESCALE, 0, 0x1_0000, 0x0100_0000, 0, 0]);
            put32(out, &MATRIX);
            put32(out, &[0, 0, 0, 0, 0, 0, 2]);
        });
        boxed(out, b"trak", |out| trak(out, track));
        boxed(out, b"mvex", |out| {
            reserved = out.len() as u64;
            // As long as the `mehd` that takes its place when the duration is known.
            boxed(out, b"free", |out| out.extend_from_slice(&[0; 12]));
            full(out, b"trex", 0, 0, |out| put32(out, &[1, 1, 0, 0, 0]));
        });
    });
    (out, reserved)
}

/// The `mehd` box that tells the whole duration, in ticks.
pub(super) fn duration(ticks: u64) -> Vec<u8> {
    let mut out = Vec::with_capacity(20);
    full(&mut out, b"mehd", 1, 0, |out| put64(out, &[ticks]));
    out
}

fn trak(out: &mut Vec<u8>, track: &Track<'_>) {
    full(out, b"tkhd", 0, 3, |out| {
        put32(out, &[0, 0, 1, 0, 0, 0, 0, 0, 0]);
        put32(out, &MATRIX);
        put32(out, &[u32::from(track.width) << 16, u32::from(track.height) << 16]);
    });
    boxed(out, b"mdia", |out| {
        // Language `und`.
        full(out, b"mdhd", 0, 0, |out| put32(out, &[0, 0, TIMESCALE, 0, 0x55c4_0000]));
        full(out, b"hdlr", 0, 0, |out| {
            put32(out, &[0]);
            out.extend_from_slice(b"vide");
            put32(out, &[0, 0, 0]);
            out.extend_from_slice(b"video\0");
        });
        boxed(out, b"minf", |out| {
            full(out, b"vmhd", 0, 1, |out| put32(out, &[0, 0]));
            boxed(out, b"dinf", |out| {
                full(out, b"dref", 0, 0, |out| {
                    put32(out, &[1]);
                    // Flag 1: the samples are in this file.
                    full(out, b"url ", 0, 1, |_| {});
                });
            });
            boxed(out, b"stbl", |out| {
                full(out, b"stsd", 0, 0, |out| {
                    put32(out, &[1]);
                    boxed(out, b"avc1", |out| avc1(out, track));
                });
                full(out, b"stts", 0, 0, |out| put32(out, &[0]));
                full(out, b"stsc", 0, 0, |out| put32(out, &[0]));
                full(out, b"stsz", 0, 0, |out| put32(out, &[0, 0]));
                full(out, b"stco", 0, 0, |out| put32(out, &[0]));
            });
        });
    });
}

fn avc1(out: &mut Vec<u8>, track: &Track<'_>) {
    put16(out, &[0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, track.width, track.height]);
    // 72 dpi both ways, one frame a sample, no compressor name, 24 bits.
    put32(out, &[0x48_0000, 0x48_0000, 0]);
    put16(out, &[1]);
    out.extend_from_slice(&[0; 32]);
    put16(out, &[0x18, 0xffff]);
    boxed(out, b"avcC", |out| {
        let byte = |k: usize| track.sequence.get(k).copied().unwrap_or(0);
        // Version 1; profile, compatibility and level; 4-byte lengths; one set of each kind.
        out.extend_from_slice(&[1, byte(1), byte(2), byte(3), 0xff, 0xe1]);
        put16(out, &[track.sequence.len() as u16]);
        out.extend_from_slice(track.sequence);
        out.push(1);
        put16(out, &[track.pictures.len() as u16]);
        out.extend_from_slice(track.pictures);
    });
    if let Some((width, height)) = track.pixel_aspect {
        boxed(out, b"pasp", |out| put32(out, &[width, height]));
    }
    boxed(out, b"colr", |out| {
        // BT.709 primaries, transfer and matrix; limited range.
        out.extend_from_slice(b"nclx");
        put16(out, &[1, 1, 1]);
        out.push(0);
    });
}

/// Appends `moof` and the header of the `mdat` whose samples must follow.
pub(super) fn fragment(out: &mut Vec<u8>, number: u32, time: u64, samples: &[Sample]) {
    let start = out.len();
    let mut offset_at = 0;
    boxed(out, b"moof", |out| {
        full(out, b"mfhd", 0, 0, |out| put32(out, &[number]));
        boxed(out, b"traf", |out| {
            // Offsets count from the beginning of this `moof`.
            full(out, b"tfhd", 0, 0x2_0000, |out| put32(out, &[1]));
            full(out, b"tfdt", 1, 0, |out| put64(out, &[time]));
            // Data offset; duration, size and flags of each sample.
            full(out, b"trun", 0, 0x701, |out| {
                put32(out, &[samples.len() as u32]);
                offset_at = out.len();
                put32(out, &[0]);
                for sample in samples {
                    // Depends on no other sample; or depends on others and is no sync sample.
                    let flags = if sample.keyframe { 0x0200_0000 } else { 0x0101_0000 };
                    put32(out, &[sample.duration, sample.size, flags]);
                }
            });
        });
    });
    let data_offset = (out.len() - start + 8) as u32;
    out[offset_at..offset_at + 4].copy_from_slice(&data_offset.to_be_bytes());
    let payload: u32 = samples.iter().map(|s| s.size).sum();
    put32(out, &[payload + 8]);
    out.extend_from_slice(b"mdat");
}

/// `mfra`: the index of entry points at the file's end, for players that jump.
pub(super) fn index(entries: &[EntryPoint]) -> Vec<u8> {
    let mut out = Vec::with_capacity(64 + 19 * entries.len());
    boxed(&mut out, b"mfra", |out| {
        full(out, b"tfra", 1, 0, |out| {
            put32(out, &[1, 0, entries.len() as u32]);
            for entry in entries {
                put64(out, &[entry.time, entry.offset]);
                out.extend_from_slice(&[1, 1, 1]);
            }
        });
    });
    // `mfro`, last in `mfra`, holds the length of both.
    let length = out.len() as u32 + 16;
    full(&mut out, b"mfro", 0, 0, |out| put32(out, &[length]));
    out[..4].copy_from_slice(&length.to_be_bytes());
    out
}
