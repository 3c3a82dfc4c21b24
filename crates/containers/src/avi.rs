//! AVI (RIFF, also its OpenDML extension): the chunks of the first video stream.

use crate::bytes::{Fields, RandomAccess, ReadSeek};
use crate::limits::{Extent, MAX_SAMPLE_BYTES, check_size};
use crate::{ContainerError, Result};

/// The largest header list of a sound file.
const MAX_HEADER_BYTES: u64 = 1 << 20;

/// What the headers say about the first video stream.
#[derive(Debug, Clone, PartialEq)]
pub struct VideoStream {
    number: u8,
    /// The codec's four-character code.
    pub codec: [u8; 4],
    /// Width and height, which a picture's own header may contradict.
    pub size: Extent,
    /// Frames per second. > 0.
    pub fps: f64,
    /// How many frames there should be; 0 where nobody filled it in.
    pub length: u64,
}

/// Walks the chunks of the first video stream one after the other, so that neither an index nor right sizes in the headers
/// are needed.
pub struct AviReader {
    input: RandomAccess,
    number: u8,
    stream: VideoStream,
    /// Where the next chunk header begins.
    at: u64,
    slots: u64,
    buffer: Vec<u8>,
}

/// Where the chunks begin.
const FIRST: u64 = 12;

impl AviReader {
    /// Reads the headers.
    ///
    /// # Errors
    /// [`ContainerError::Malformed`] when there are none, or none of a video.
    pub fn new(reader: Box<dyn ReadSeek>) -> Result<Self> {
        let mut input = RandomAccess::new(reader)?;
        let stream = read_headers(&mut input)?;
        Ok(Self { input, number: stream.number, stream, at: FIRST, slots: 0, buffer: Vec::new() })
    }

    /// What the headers say.
    pub const fn stream(&self) -> &VideoStream {
        &self.stream
    }

    /// Chunks of the stream passed so far, also those without data, which repeat the picture before: time goes by these.
    pub const fn slots(&self) -> u64 {
        self.slots
    }

    /// The data of the last chunk read.
    pub fn chunk(&self) -> &[u8] {
        &self.buffer
    }

    /// Goes back to before the first chunk.
    pub const fn rewind(&mut self) {
        (self.at, self.slots) = (FIRST, 0);
    }

    /// Reads the next chunk of our stream that has data into the buffer; `false` at the end.
    ///
    /// # Errors
    /// [`ContainerError::Malformed`] when the file ends within a chunk, or one is absurdly long.
    pub fn next_chunk(&mut self) -> Result<bool> {
        loop {
            let Some((kind, length)) = chunk_header(&mut self.input, self.at)? else { return Ok(false) };
            let body = self.at + 8;
            let end = body + length + length % 2;
            match &kind {
                // Lists and further RIFF parts are entered, not skipped: their own header is 12 bytes.
                b"RIFF" => self.at += 12,
                b"LIST" => {
                    let (list, _) = self.input.peek::<4>(body)?;
                    self.at = if matches!(&list, b"movi" | b"rec ") { body + 4 } else { end };
                }
                [tens, ones, b'd', b'c' | b'b'] if stream_number(*tens, *ones) == Some(self.number) => {
                    self.at = end;
                    self.slots += 1;
                    if length > 0 {
                        if length > MAX_SAMPLE_BYTES {
                            return Err(ContainerError::malformed(format!(
                                "a frame of {length} bytes cannot be right"
                            )));
                        }
                        self.input.read_at(body, length, &mut self.buffer)?;
                        return Ok(true);
                    }
                }
                _ => self.at = end,
            }
        }
    }
}

/// Type and length of the chunk at `at`, or `None` at the end of the file.
fn chunk_header(input: &mut RandomAccess, at: u64) -> Result<Option<([u8; 4], u64)>> {
    let (bytes, available) = input.peek::<8>(at)?;
    let mut fields = Fields(&bytes[..available]);
    Ok(fields.array::<4>().zip(fields.u32_le().map(u64::from)))
}

fn stream_number(tens: u8, ones: u8) -> Option<u8> {
    let digit = |b: u8| char::from(b).to_digit(10);
    u8::try_from(digit(tens)? * 10 + digit(ones)?).ok()
}

/// Finds the header list and the first video stream in it.
fn read_headers(input: &mut RandomAccess) -> Result<VideoStream> {
    let mut at = 12;
    while let Some((kind, length)) = chunk_header(input, at)? {
        let (list, _) = input.peek::<4>(at + 8)?;
        if (&kind, &list) == (b"LIST", b"hdrl") {
            if length > MAX_HEADER_BYTES {
                break;
            }
            let mut body = Vec::new();
            input.read_at(at + 8, length, &mut body)?;
            return video_stream(body.get(4..).unwrap_or_default());
        }
        at += 8 + length + length % 2;
    }
    Err(ContainerError::malformed("the AVI has no header; record or copy it again"))
}

fn video_stream(hdrl: &[u8]) -> Result<VideoStream> {
    let lists = chunks(hdrl).filter(|(kind, body)| kind == b"LIST" && body.starts_with(b"strl"));
    for (number, (_, body)) in (0u8..=99).zip(lists) {
        let find = |wanted: &[u8; 4]| chunks(&body[4..]).find(|(kind, _)| kind == wanted).map(|(_, body)| body);
        if let (Some(header), Some(format)) = (find(b"strh"), find(b"strf"))
            && header.starts_with(b"vids")
        {
            return stream_of(number, header, format)
                .unwrap_or_else(|| Err(ContainerError::malformed("its AVI header is cut short")));
        }
    }
    Err(ContainerError::malformed("the AVI has no video stream"))
}

/// From `strh` and `strf` (a BITMAPINFOHEADER).
fn stream_of(number: u8, header: &[u8], format: &[u8]) -> Option<Result<VideoStream>> {
    let mut fields = Fields(header);
    fields.bytes(20)?;
    let (scale, rate) = (fields.u32_le()?, fields.u32_le()?);
    fields.u32_le()?;
    let length = u64::from(fields.u32_le()?);
    let mut fields = Fields(format);
    fields.u32_le()?;
    let (width, height) = (fields.u32_le()?, fields.u32_le()?.cast_signed().unsigned_abs());
    fields.u32_le()?;
    let codec = fields.array::<4>()?;
    if scale == 0 || rate == 0 {
        return Some(Err(ContainerError::malformed("its AVI header gives no frame rate")));
    }
    let fps = f64::from(rate) / f64::from(scale);
    Some(check_size(width.into(), height.into()).map(|size| VideoStream { number, codec, size, fps, length }))
}

/// The chunks inside a list.
fn chunks(body: &[u8]) -> impl Iterator<Item = ([u8; 4], &[u8])> {
    let mut rest = Fields(body);
    std::iter::from_fn(move || {
        let kind = rest.array::<4>()?;
        let length = rest.u32_le()? as usize;
        let body = rest.bytes(length)?;
        rest.bytes((length % 2).min(rest.0.len()))?;
        Some((kind, body))
    })
}
