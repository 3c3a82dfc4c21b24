use super::bytes::{Fields, RandomAccess, ReadSeek};
use super::fault::Fault;
use super::image::{JpegScan, decode_jpeg};
use super::limits::{MAX_SAMPLE_BYTES, check_size};
use crate::{Result, Source, SourceInfo};
use pursuit_geometry::Size;
use pursuit_imaging::Frame;

/// The largest header list of a sound file.
const MAX_HEADER_BYTES: u64 = 1 << 20;

/// Motion JPEG in AVI (RIFF, also its OpenDML extension), decoded here.
///
/// Chunks are walked one after the other, so neither an index nor right sizes in the headers are needed. A chunk without
/// data repeats the frame before it in an AVI: it takes its time, but is not delivered twice.
pub(crate) struct AviSource {
    input: RandomAccess,
    stream: VideoStream,
    info: SourceInfo,
    /// Where the next chunk header begins.
    at: u64,
    /// Chunks of the video stream so far: time goes by these.
    slots: u64,
    next: u64,
    finished: bool,
    buffer: Vec<u8>,
}

/// What the headers say about the first video stream.
#[derive(Debug, Clone, PartialEq)]
struct VideoStream {
    number: u8,
    codec: [u8; 4],
    size: Size,
    fps: f64,
    length: u64,
}

impl AviSource {
    pub fn new(reader: Box<dyn ReadSeek>, name: &str) -> Result<Self, Fault> {
        let mut input = RandomAccess::new(reader)?;
        let stream = read_headers(&mut input)?;
        if !matches!(&stream.codec.map(|b| b.to_ascii_uppercase()), b"MJPG" | b"JPEG") {
            return Err(Fault::unsupported(format!("the codec {} in AVI", stream.codec.escape_ascii())));
        }
        let info = SourceInfo {
            name: name.to_owned(),
            size: stream.size,
            fps: Some(stream.fps),
            frame_count: Some(stream.length).filter(|&n| n > 0),
            live: false,
            decoder: "Motion JPEG in AVI (built in)".to_owned(),
            truth: None,
        };
        let buffer = Vec::new();
        let mut source = Self { input, stream, info, at: 12, slots: 0, next: 0, finished: false, buffer };
        source.check_first_picture()?;
        Ok(source)
    }

    /// The JPEG's own size counts, and one of half the height means that fields are stored one by one.
    fn check_first_picture(&mut self) -> Result<(), Fault> {
        if !self.next_chunk()? {
            return Err(Fault::malformed("the AVI has no frames"));
        }
        let size = JpegScan::read(&self.buffer)?.size;
        if size.height < self.stream.size.height {
            return Err(Fault::unsupported("Motion JPEG stored as fields"));
        }
        self.info.size = size;
        (self.at, self.slots) = (12, 0);
        Ok(())
    }

    /// Reads the next chunk of our stream that has data into the buffer; `false` at the end.
    fn next_chunk(&mut self) -> Result<bool, Fault> {
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
                [tens, ones, b'd', b'c' | b'b'] if stream_number(*tens, *ones) == Some(self.stream.number) => {
                    self.at = end;
                    self.slots += 1;
                    if length > 0 {
                        if length > MAX_SAMPLE_BYTES {
                            return Err(Fault::malformed(format!("a frame of {length} bytes cannot be right")));
                        }
                        self.input.read_at(body, length, &mut self.buffer)?;
                        return Ok(true);
                    }
                }
                _ => self.at = end,
            }
        }
    }

    fn read_frame(&mut self) -> Result<Option<Frame>, Fault> {
        if !self.next_chunk()? {
            return match self.info.frame_count {
                // Writers that crash leave a length of zero or of more than they wrote.
                Some(count) if self.slots < count => {
                    Err(Fault::malformed(format!("the file ends early ({count} frames were promised)")))
                }
                _ => Ok(None),
            };
        }
        let pixels = decode_jpeg(&self.buffer)?;
        let time_s = (self.slots - 1) as f64 / self.stream.fps;
        let frame = Frame::new(self.next, time_s, pixels);
        if frame.size() != self.info.size {
            let (size, first) = (frame.size(), self.info.size);
            return Err(Fault::malformed(format!("the picture changes from {first} to {size}; cut the file there")));
        }
        self.next += 1;
        Ok(Some(frame))
    }
}

impl Source for AviSource {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_frame(&mut self) -> Result<Option<Frame>> {
        if self.finished {
            return Ok(None);
        }
        let frame = self.read_frame();
        self.finished = !matches!(frame, Ok(Some(_)));
        frame.map_err(|fault| fault.broken(&self.info.name, self.next))
    }
}

/// Type and length of the chunk at `at`, or `None` at the end of the file.
fn chunk_header(input: &mut RandomAccess, at: u64) -> Result<Option<([u8; 4], u64)>, Fault> {
    let (bytes, available) = input.peek::<8>(at)?;
    let mut fields = Fields(&bytes[..available]);
    Ok(fields.array::<4>().zip(fields.u32_le().map(u64::from)))
}

fn stream_number(tens: u8, ones: u8) -> Option<u8> {
    let digit = |b: u8| char::from(b).to_digit(10);
    u8::try_from(digit(tens)? * 10 + digit(ones)?).ok()
}

/// Finds the header list and the first video stream in it.
fn read_headers(input: &mut RandomAccess) -> Result<VideoStream, Fault> {
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
    Err(Fault::malformed("the AVI has no header; record or copy it again"))
}

fn video_stream(hdrl: &[u8]) -> Result<VideoStream, Fault> {
    let lists = chunks(hdrl).filter(|(kind, body)| kind == b"LIST" && body.starts_with(b"strl"));
    for (number, (_, body)) in (0u8..=99).zip(lists) {
        let find = |wanted: &[u8; 4]| chunks(&body[4..]).find(|(kind, _)| kind == wanted).map(|(_, body)| body);
        if let (Some(header), Some(format)) = (find(b"strh"), find(b"strf"))
            && header.starts_with(b"vids")
        {
            return stream_of(number, header, format)
                .unwrap_or_else(|| Err(Fault::malformed("its AVI header is cut short")));
        }
    }
    Err(Fault::malformed("the AVI has no video stream"))
}

/// From `strh` and `strf` (a BITMAPINFOHEADER).
fn stream_of(number: u8, header: &[u8], format: &[u8]) -> Option<Result<VideoStream, Fault>> {
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
        return Some(Err(Fault::malformed("its AVI header gives no frame rate")));
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
