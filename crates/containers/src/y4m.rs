//! Y4M: uncompressed pictures in a pipe (<https://wiki.multimedia.cx/index.php/YUV4MPEG2>).

use crate::limits::{Extent, check_size};
use crate::{ContainerError, Result};
use std::io::{BufRead, Read};

/// The first bytes of every Y4M stream.
pub const MAGIC: &[u8] = b"YUV4MPEG2";

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
pub struct Header {
    /// Width and height.
    pub size: Extent,
    /// Frames per second, where it says so. > 0.
    pub fps: Option<f64>,
    /// Width against height of a pixel, where it says so.
    pub pixel_aspect: Option<(u32, u32)>,
    layout: Layout,
    /// Whether samples use their full range, where it says so.
    pub full_range: Option<bool>,
    /// Bytes of the header line.
    len: u64,
}

impl Header {
    /// Reads the stream header.
    ///
    /// # Errors
    /// [`ContainerError::Malformed`] where there is none, [`ContainerError::Unsupported`] for other layouts of samples.
    pub fn read(reader: &mut impl BufRead) -> Result<Self> {
        let line = read_line(reader)?.ok_or_else(|| ContainerError::malformed("it is empty"))?;
        let text = String::from_utf8_lossy(&line);
        let mut words = text.split_ascii_whitespace();
        if words.next().map(str::as_bytes) != Some(MAGIC) {
            return Err(ContainerError::malformed("it does not begin with a Y4M header"));
        }
        let (mut width, mut height, mut fps) = (0, 0, None);
        let (mut layout, mut full_range, mut pixel_aspect) = (Layout::Yuv420, None, None);
        for word in words {
            match word.split_at_checked(1) {
                Some(("W", v)) => width = number(v)?,
                Some(("H", v)) => height = number(v)?,
                Some(("F", v)) => fps = rate(v),
                Some(("A", v)) => pixel_aspect = aspect(v),
                Some(("C", v)) => layout = layout_of(v)?,
                Some(("X", "COLORRANGE=FULL")) => full_range = Some(true),
                Some(("X", "COLORRANGE=LIMITED")) => full_range = Some(false),
                _ => {} // interlacing, comments: nothing a tracker uses
            }
        }
        Ok(Self { size: check_size(width, height)?, fps, pixel_aspect, layout, full_range, len: line.len() as u64 + 1 })
    }

    /// Bytes of one frame's samples.
    fn frame_bytes(&self) -> u64 {
        let Extent { width, height } = self.size;
        let chroma = width.div_ceil(2) * height.div_ceil(2);
        (match self.layout {
            Layout::Gray8 => width * height,
            Layout::Gray16 => 2 * width * height,
            Layout::Yuv420 => width * height + 2 * chroma,
        }) as u64
    }

    /// Frames in a file of `len` bytes whose frame headers carry no parameters, as all common writers leave them.
    pub fn frames_in(&self, len: u64) -> Option<u64> {
        let (body, frame) = (len.checked_sub(self.len)?, self.frame_bytes() + b"FRAME\n".len() as u64);
        body.is_multiple_of(frame).then_some(body / frame)
    }
}

fn number(text: &str) -> Result<u64> {
    text.parse()
        .map_err(|_| ContainerError::malformed(format!("its Y4M header has {text:?} where a size should stand")))
}

fn rate(text: &str) -> Option<f64> {
    let (numerator, denominator) = text.split_once(':')?;
    let fps = numerator.parse::<f64>().ok()? / denominator.parse::<f64>().ok()?;
    (fps.is_finite() && fps > 0.0).then_some(fps)
}

/// A ratio of whole numbers; `0:0` says that it is not known.
fn aspect(text: &str) -> Option<(u32, u32)> {
    let (width, height) = text.split_once(':')?;
    Some((width.parse().ok()?, height.parse().ok()?)).filter(|&(w, h)| w > 0 && h > 0)
}

fn layout_of(text: &str) -> Result<Layout> {
    match text {
        "420" | "420jpeg" | "420mpeg2" | "420paldv" => Ok(Layout::Yuv420),
        "mono" => Ok(Layout::Gray8),
        "mono16" => Ok(Layout::Gray16),
        other => Err(ContainerError::unsupported(format!("Y4M with sample layout {other:.16}"))),
    }
}

/// One line without its newline, or `None` at the end of the stream.
fn read_line(reader: &mut impl BufRead) -> Result<Option<Vec<u8>>> {
    let mut line = Vec::new();
    reader.take(MAX_HEADER_BYTES).read_until(b'\n', &mut line)?;
    match line.pop() {
        None => Ok(None),
        Some(b'\n') => Ok(Some(line)),
        Some(_) => Err(ContainerError::malformed("a Y4M header has no end; the stream is damaged")),
    }
}

/// The samples of one frame, row by row; chroma planes have half the sides, rounded up.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Planes {
    /// Grey.
    Gray8(Vec<u8>),
    /// Grey of 16 bits.
    Gray16(Vec<u16>),
    /// Y, U, V at 4:2:0.
    Yuv420([Vec<u8>; 3]),
}

/// Reads a stream frame by frame.
pub struct Y4mReader<R> {
    reader: R,
    /// What stands before the first frame.
    pub header: Header,
}

impl<R: BufRead> Y4mReader<R> {
    /// Reads the stream header.
    ///
    /// # Errors
    /// As [`Header::read`].
    pub fn new(mut reader: R) -> Result<Self> {
        let header = Header::read(&mut reader)?;
        Ok(Self { reader, header })
    }

    /// The samples of the next frame, or `None` at a clean end.
    ///
    /// # Errors
    /// [`ContainerError::Malformed`] when the stream is damaged or ends within a frame.
    pub fn next_planes(&mut self) -> Result<Option<Planes>> {
        let Some(line) = read_line(&mut self.reader)? else { return Ok(None) };
        if !line.starts_with(b"FRAME") {
            return Err(ContainerError::malformed("no Y4M frame header where one should stand; the stream is damaged"));
        }
        let Extent { width, height } = self.header.size;
        Ok(Some(match self.header.layout {
            Layout::Gray8 => Planes::Gray8(self.samples(width * height)?),
            Layout::Gray16 => {
                let bytes = self.samples(2 * width * height)?;
                Planes::Gray16(bytes.as_chunks::<2>().0.iter().map(|&b| u16::from_le_bytes(b)).collect())
            }
            Layout::Yuv420 => {
                let (cw, ch) = (width.div_ceil(2), height.div_ceil(2));
                Planes::Yuv420([self.samples(width * height)?, self.samples(cw * ch)?, self.samples(cw * ch)?])
            }
        }))
    }

    /// Grows with what really arrives, so that a header alone cannot make us allocate a large frame.
    fn samples(&mut self, count: usize) -> Result<Vec<u8>> {
        let mut data = Vec::with_capacity(count.min(1 << 20));
        self.reader.by_ref().take(count as u64).read_to_end(&mut data)?;
        if data.len() == count {
            Ok(data)
        } else {
            Err(ContainerError::malformed("the stream ends in the middle of a frame"))
        }
    }
}
