use super::boxes::{FileBox, child, children, file_box, full};
use super::edits::Edits;
use super::fragments::{Defaults, Fragments};
use super::{AvcConfig, Codec, ColorTags, Sample, announced, samples};
use crate::bytes::{Fields, RandomAccess};
use crate::limits::check_size;
use crate::{ContainerError, Result};

/// The largest index read into memory; that of a ten-hour film is a tenth of it.
const MAX_INDEX_BYTES: u64 = 64 << 20;

/// Segment indices looked at; what more there are say nothing new.
const MAX_INDICES: usize = 1 << 16;

/// An MP4 or QuickTime file whose index has been read.
pub struct Movie {
    /// The file, to read samples from.
    pub input: RandomAccess,
    /// Its first video track.
    pub track: VideoTrack,
    /// What of the file's own statements is not true of it, so that frames may be missing without anything pointing to
    /// them: it ends within a box, its index lists more frames than it places, its length is another.
    pub flaw: Option<String>,
}

/// The first video track.
#[derive(Debug, Clone, PartialEq)]
pub struct VideoTrack {
    /// How its pictures are coded.
    pub codec: Codec,
    /// Time units per second.
    pub time_scale: u32,
    /// In decoding order.
    pub samples: Vec<Sample>,
    /// Which samples are shown, and when.
    pub edits: Edits,
    /// How the picture is turned for display: the upper left 2 × 2 of the track's matrix, a b c d in 16.16 fixed point
    /// (ISO/IEC 14496-12 §6.2.2: `x' = a x + c y`, `y' = b x + d y`).
    pub matrix: [i32; 4],
}

impl Movie {
    /// Reads the index.
    ///
    /// # Errors
    /// [`ContainerError::Malformed`] when there is no index or it is damaged, [`ContainerError::Unsupported`] for edit lists
    /// that repeat, reverse or retime.
    pub fn read(mut input: RandomAccess) -> Result<Self> {
        let (mut moov, mut fragments, mut indices, mut cut) = (None, Vec::new(), Vec::new(), false);
        let mut at = 0;
        while let Some(found) = file_box(&mut input, at)? {
            cut = found.end > input.len();
            match &found.kind {
                b"moov" if moov.is_none() => moov = Some(read_body(&mut input, &found)?),
                b"moof" if !cut => fragments.push(found),
                b"sidx" if !cut && indices.len() < MAX_INDICES => indices.push(found),
                _ => {}
            }
            at = found.end.min(input.len());
        }
        let moov = moov.ok_or_else(|| no_index(cut))?;
        // What is left and is no box is the beginning of one, unless it is nothing but zeros.
        let (rest, available) = input.peek::<16>(at)?;
        cut |= rest[..available].iter().any(|&b| b != 0);
        let (track, flaw) = VideoTrack::read(&moov, &fragments, &indices, &mut input)?;
        let ends_early = || "the file ends early; it may not have been copied to its end".to_owned();
        Ok(Self { input, track, flaw: cut.then(ends_early).or(flaw) })
    }
}

fn no_index(cut: bool) -> ContainerError {
    ContainerError::malformed(if cut {
        "the MP4 ends before its index (moov): the recording or copy was cut off; copy it again or repair it"
    } else {
        "it has no MP4 index (moov), so there is no video in it"
    })
}

fn read_body(input: &mut RandomAccess, found: &FileBox) -> Result<Vec<u8>> {
    if found.end > input.len() {
        return Err(no_index(true));
    }
    if found.end - found.body > MAX_INDEX_BYTES {
        let mebibytes = MAX_INDEX_BYTES >> 20;
        return Err(ContainerError::malformed(format!("its MP4 index is larger than {mebibytes} MiB; cut the file")));
    }
    let mut body = Vec::new();
    input.read_at(found.body, found.end - found.body, &mut body)?;
    Ok(body)
}

impl VideoTrack {
    /// The track, and what of the file's own statements is not true of it.
    fn read(
        moov: &[u8],
        fragments: &[FileBox],
        indices: &[FileBox],
        input: &mut RandomAccess,
    ) -> Result<(Self, Option<String>)> {
        let trak = children(moov).filter(|(kind, _)| kind == b"trak").map(|(_, b)| b).find(|b| is_video(b));
        let trak = trak.ok_or_else(|| ContainerError::malformed("the MP4 has no video track"))?;
        let damaged = || ContainerError::malformed("its MP4 index is damaged");
        let (track_id, matrix) = child(trak, b"tkhd").and_then(track_header).ok_or_else(damaged)?;
        let mdia = child(trak, b"mdia").ok_or_else(damaged)?;
        let header = child(mdia, b"mdhd").ok_or_else(damaged)?;
        let time_scale = time_scale_of(header).ok_or_else(damaged)?;
        let movie_scale = child(moov, b"mvhd").and_then(time_scale_of).unwrap_or(1000);
        let stbl = child(mdia, b"minf").and_then(|b| child(b, b"stbl")).ok_or_else(damaged)?;
        let codec = child(stbl, b"stsd").and_then(codec_of).ok_or_else(damaged)??;
        let samples::Expanded { mut samples, end, flaw } = samples::expand(stbl, input.len())?;
        let seconds = |units: u64, scale: u32| units as f64 / f64::from(scale);
        let flaw = if let Some(defaults) = Defaults::read(moov, track_id) {
            let mut all = Fragments { track_id, defaults, samples, file_len: input.len(), decoding_time: 0 };
            for found in fragments {
                all.add(&read_body(input, found)?, found.start)?;
            }
            samples = all.samples;
            let found_s = seconds(all.decoding_time.max(0).cast_unsigned(), time_scale);
            let said_s = announced::fragments_duration(moov).map(|d| seconds(d, movie_scale));
            let mut indexed_s = None;
            for index in indices {
                let end_s = announced::indexed_end_s(&read_body(input, index)?, track_id);
                indexed_s = indexed_s.into_iter().chain(end_s).reduce(f64::max);
            }
            // Fragments may begin later than at 0: then only what is indexed says where they end.
            indexed_s.or(said_s).and_then(|said_s| announced::compare(said_s, found_s))
        } else {
            let said = announced::duration_of(header).map(|d| seconds(d, time_scale));
            flaw.or_else(|| announced::compare(said?, seconds(end, time_scale)))
        };
        let edits = Edits::read(trak, movie_scale, time_scale)?;
        Ok((Self { codec, time_scale, samples, edits, matrix }, flaw))
    }
}

fn is_video(trak: &[u8]) -> bool {
    let handler = child(trak, b"mdia").and_then(|b| child(b, b"hdlr"));
    handler.and_then(|b| b.get(8..12)) == Some(b"vide")
}

/// Track number and matrix (`tkhd`).
fn track_header(body: &[u8]) -> Option<(u32, [i32; 4])> {
    let (version, _, mut fields) = full(body)?;
    fields.skip(if version == 1 { 16 } else { 8 })?;
    let id = fields.u32()?;
    fields.skip(if version == 1 { 4 + 8 } else { 4 + 4 } + 8 + 2 + 2 + 2 + 2)?;
    let mut entry = || fields.u32().map(u32::cast_signed);
    let (a, b, _u, c, d) = (entry()?, entry()?, entry()?, entry()?, entry()?);
    Some((id, [a, b, c, d]))
}

/// Time units per second, from `mvhd` or `mdhd`, which begin alike.
fn time_scale_of(body: &[u8]) -> Option<u32> {
    let (version, _, mut fields) = full(body)?;
    fields.skip(if version == 1 { 16 } else { 8 })?;
    fields.u32().filter(|&scale| scale > 0)
}

/// How the samples are coded (`stsd`); only the first description counts.
fn codec_of(stsd: &[u8]) -> Option<Result<Codec>> {
    let (_, _, mut fields) = full(stsd)?;
    fields.u32()?;
    let (kind, entry) = children(fields.0).next()?;
    // A visual sample entry has 78 bytes before its boxes (ISO/IEC 14496-12 §12.1.3).
    let mut header = Fields(entry);
    header.skip(24)?;
    let (width, height) = (header.u16()?, header.u16()?);
    let boxes = entry.get(78..)?;
    if !matches!(&kind, b"avc1" | b"avc3") {
        return Some(Ok(Codec::Other(kind.escape_ascii().to_string())));
    }
    let Some(mut config) = child(boxes, b"avcC").and_then(avc_config) else {
        return Some(Err(ContainerError::malformed("the MP4's H.264 configuration is damaged")));
    };
    config.color = child(boxes, b"colr").and_then(color_info).unwrap_or_default();
    config.pixel_aspect = child(boxes, b"pasp").and_then(pixel_aspect);
    // The real size comes from the stream; this one only has to be sane.
    Some(check_size(width.into(), height.into()).map(|_| Codec::Avc(config)))
}

fn avc_config(body: &[u8]) -> Option<AvcConfig> {
    let mut fields = Fields(body);
    fields.skip(4)?;
    let length_bytes = usize::from(fields.u8()? & 3) + 1;
    let mut sets = |mask: u8| {
        let count = fields.u8()? & mask;
        (0..count)
            .map(|_| {
                let length = fields.u16()?;
                fields.bytes(length.into()).map(<[u8]>::to_vec)
            })
            .collect::<Option<Vec<_>>>()
    };
    Some(AvcConfig { length_bytes, sps: sets(31)?, pps: sets(255)?, color: ColorTags::default(), pixel_aspect: None })
}

/// `pasp`: horizontal and vertical spacing.
fn pixel_aspect(body: &[u8]) -> Option<(u32, u32)> {
    let mut fields = Fields(body);
    Some((fields.u32()?, fields.u32()?)).filter(|&(w, h)| w > 0 && h > 0)
}

/// `colr` of type `nclx` (MP4) or `nclc` (QuickTime).
fn color_info(body: &[u8]) -> Option<ColorTags> {
    let mut fields = Fields(body);
    let kind = fields.array::<4>()?;
    if !matches!(&kind, b"nclx" | b"nclc") {
        return None;
    }
    fields.skip(4)?;
    let matrix_code = Some(u8::try_from(fields.u16()?).unwrap_or(0));
    let full_range = (&kind == b"nclx").then(|| fields.u8()).flatten().map(|b| b & 0x80 != 0);
    Some(ColorTags { matrix_code, full_range })
}
