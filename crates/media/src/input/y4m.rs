use super::color::ColorInfo;
use super::fault::Fault;
use super::limits::check_size;
use crate::{Result, Source, SourceInfo};
use pursuit_geometry::Size;
use pursuit_imaging::{ColorRange, Frame, Image, Pixels, Yuv420};
use std::io::{BufRead, Read};

/// The first bytes of every Y4M stream.
pub(crate) const MAGIC: &[u8] = b"YUV4MPEG2";

/// No writer needs more than a few dozen bytes for a stream or frame header.
const MAX_HEADER_BYTES: u64 = 1024;

/// How the samples of one frame are laid out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Layout {
    Gray8,
    Gray16,
    Yuv420,
}

/// The stream header (<https://wiki.multimedia.cx/index.php/YUV4MPEG2>).
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Header {
    pub size: Size,
    pub fps: Option<f64>,
    layout: Layout,
    pub color: ColorInfo,
    /// Bytes of the header line.
    len: u64,
}

impl Header {
    pub fn read(reader: &mut impl BufRead) -> Result<Self, Fault> {
        let line = read_line(reader)?.ok_or_else(|| Fault::malformed("it is empty"))?;
        let text = String::from_utf8_lossy(&line);
        let mut words = text.split_ascii_whitespace();
        if words.next().map(str::as_bytes) != Some(MAGIC) {
            return Err(Fault::malformed("it does not begin with a Y4M header"));
        }
        let (mut width, mut height, mut fps) = (0, 0, None);
        let (mut layout, mut color) = (Layout::Yuv420, ColorInfo::default());
        for word in words {
            match word.split_at_checked(1) {
                Some(("W", v)) => width = number(v)?,
                Some(("H", v)) => height = number(v)?,
                Some(("F", v)) => fps = rate(v),
                Some(("C", v)) => layout = layout_of(v)?,
                Some(("X", "COLORRANGE=FULL")) => color.range = Some(ColorRange::Full),
                Some(("X", "COLORRANGE=LIMITED")) => color.range = Some(ColorRange::Limited),
                _ => {} // interlacing, pixel aspect, comments: nothing a tracker uses
            }
        }
        Ok(Self { size: check_size(width, height)?, fps, layout, color, len: line.len() as u64 + 1 })
    }

    /// Bytes of one frame's samples.
    fn frame_bytes(&self) -> u64 {
        let Size { width, height } = self.size;
        let chroma = width.div_ceil(2) * height.div_ceil(2);
        (match self.layout {
            Layout::Gray8 => width * height,
            Layout::Gray16 => 2 * width * height,
            Layout::Yuv420 => width * height + 2 * chroma,
        }) as u64
    }

    /// Frames in a file of `len` bytes whose frame headers carry no parameters, as all common writers leave them.
    fn frames_in(&self, len: u64) -> Option<u64> {
        let (body, frame) = (len.checked_sub(self.len)?, self.frame_bytes() + b"FRAME\n".len() as u64);
        body.is_multiple_of(frame).then_some(body / frame)
    }
}

fn number(text: &str) -> Result<u64, Fault> {
    text.parse().map_err(|_| Fault::malformed(format!("its Y4M header has {text:?} where a size should stand")))
}

fn rate(text: &str) -> Option<f64> {
    let (numerator, denominator) = text.split_once(':')?;
    let fps = numerator.parse::<f64>().ok()? / denominator.parse::<f64>().ok()?;
    (fps.is_finite() && fps > 0.0).then_some(fps)
}

fn layout_of(text: &str) -> Result<Layout, Fault> {
    match text {
        "420" | "420jpeg" | "420mpeg2" | "420paldv" => Ok(Layout::Yuv420),
        "mono" => Ok(Layout::Gray8),
        "mono16" => Ok(Layout::Gray16),
        other => Err(Fault::unsupported(format!("Y4M with sample layout {other:.16}"))),
    }
}

/// One line without its newline, or `None` at the end of the stream.
fn read_line(reader: &mut impl BufRead) -> Result<Option<Vec<u8>>, Fault> {
    let mut line = Vec::new();
    reader.take(MAX_HEADER_BYTES).read_until(b'\n', &mut line)?;
    match line.pop() {
        None => Ok(None),
        Some(b'\n') => Ok(Some(line)),
        Some(_) => Err(Fault::malformed("a Y4M header has no end; the stream is damaged")),
    }
}

/// The samples of one frame, before anything is known about colour.
pub(crate) enum Planes {
    Gray8(Image<u8>),
    Gray16(Image<u16>),
    Yuv420([Image<u8>; 3]),
}

impl Planes {
    /// With what is known about colour.
    pub fn into_pixels(self, color: ColorInfo) -> Result<Pixels, Fault> {
        Ok(match self {
            Self::Gray8(image) => image.into(),
            Self::Gray16(image) => image.into(),
            Self::Yuv420([y, u, v]) => {
                let (matrix, range) = color.resolve(y.size());
                Pixels::Yuv420(Yuv420::new(y, u, v, matrix, range)?)
            }
        })
    }
}

/// Reads samples from Y4M; also the reader of what an `ffmpeg` process writes.
pub(crate) struct Y4mReader<R> {
    reader: R,
    pub header: Header,
}

impl<R: BufRead> Y4mReader<R> {
    pub fn new(mut reader: R) -> Result<Self, Fault> {
        let header = Header::read(&mut reader)?;
        Ok(Self { reader, header })
    }

    /// The samples of the next frame, or `None` at a clean end.
    pub fn next_planes(&mut self) -> Result<Option<Planes>, Fault> {
        let Some(line) = read_line(&mut self.reader)? else { return Ok(None) };
        if !line.starts_with(b"FRAME") {
            return Err(Fault::malformed("no Y4M frame header where one should stand; the stream is damaged"));
        }
        let Size { width, height } = self.header.size;
        Ok(Some(match self.header.layout {
            Layout::Gray8 => Planes::Gray8(self.plane(width, height)?),
            Layout::Gray16 => {
                let bytes = self.samples(2 * width * height)?;
                let data = bytes.as_chunks::<2>().0.iter().map(|&b| u16::from_le_bytes(b)).collect();
                Planes::Gray16(Image::from_vec(data, width, height)?)
            }
            Layout::Yuv420 => {
                let (cw, ch) = (width.div_ceil(2), height.div_ceil(2));
                Planes::Yuv420([self.plane(width, height)?, self.plane(cw, ch)?, self.plane(cw, ch)?])
            }
        }))
    }

    fn plane(&mut self, width: usize, height: usize) -> Result<Image<u8>, Fault> {
        Ok(Image::from_vec(self.samples(width * height)?, width, height)?)
    }

    /// Grows with what really arrives, so that a header alone cannot make us allocate a large frame.
    fn samples(&mut self, count: usize) -> Result<Vec<u8>, Fault> {
        let mut data = Vec::with_capacity(count.min(1 << 20));
        self.reader.by_ref().take(count as u64).read_to_end(&mut data)?;
        if data.len() == count { Ok(data) } else { Err(Fault::malformed("the stream ends in the middle of a frame")) }
    }
}

/// A Y4M file, or Y4M on standard input.
pub(crate) struct Y4mSource<R> {
    reader: Y4mReader<R>,
    info: SourceInfo,
    next: u64,
    fps: f64,
    finished: bool,
}

impl<R: BufRead + Send> Y4mSource<R> {
    /// `file_len` is the whole input's length where it is known.
    pub fn new(reader: R, name: &str, file_len: Option<u64>, default_fps: f64) -> Result<Self, Fault> {
        let reader = Y4mReader::new(reader)?;
        let header = &reader.header;
        let info = SourceInfo {
            name: name.to_owned(),
            size: header.size,
            fps: header.fps,
            frame_count: file_len.and_then(|len| header.frames_in(len)),
            live: false,
            decoder: "Y4M (built in)".to_owned(),
            truth: None,
        };
        let fps = header.fps.unwrap_or(default_fps);
        Ok(Self { reader, info, next: 0, fps, finished: false })
    }
}

impl<R: BufRead + Send> Source for Y4mSource<R> {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_frame(&mut self) -> Result<Option<Frame>> {
        if self.finished {
            return Ok(None);
        }
        let color = self.reader.header.color;
        match self.reader.next_planes().and_then(|planes| planes.map(|p| p.into_pixels(color)).transpose()) {
            Ok(Some(pixels)) => {
                let frame = Frame::new(self.next, self.next as f64 / self.fps, pixels);
                self.next += 1;
                Ok(Some(frame))
            }
            Ok(None) => {
                self.finished = true;
                Ok(None)
            }
            Err(fault) => {
                self.finished = true;
                Err(fault.broken(&self.info.name, self.next))
            }
        }
    }
}
