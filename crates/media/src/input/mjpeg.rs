use super::fault::{Fault, Trouble};
use super::image::{JpegScan, decode_jpeg};
use crate::{Result, Source, SourceInfo};
use pursuit_containers::mjpeg::next_image;
use pursuit_geometry::Size;
use pursuit_imaging::Frame;
use std::io::BufRead;

/// JPEG images one after the other, in a file or on standard input. They carry no times: frames are evenly spaced.
pub(crate) struct MjpegSource<R> {
    reader: R,
    first: Option<Frame>,
    info: SourceInfo,
    fps: f64,
    next: u64,
    finished: bool,
}

impl<R: BufRead + Send> MjpegSource<R> {
    pub fn new(mut reader: R, name: &str, fps: f64) -> Result<Self, Fault> {
        let bytes = next_image(&mut reader)?.ok_or_else(|| Fault::malformed("there is no JPEG in it"))?;
        let first = Frame::new(0, 0.0, decode_jpeg(&bytes)?);
        let info = SourceInfo { fps: Some(fps), ..SourceInfo::new(name, first.size(), "Motion JPEG (built in)") };
        Ok(Self { reader, first: Some(first), info, fps, next: 0, finished: false })
    }

    fn read_frame(&mut self) -> Result<Option<Frame>, Trouble> {
        let index = self.next;
        let end = |fault: Fault| Trouble::end(index, fault);
        self.next += 1;
        let frame = match self.first.take() {
            Some(frame) => frame,
            None => {
                let Some(bytes) = next_image(&mut self.reader).map_err(|e| end(e.into()))? else { return Ok(None) };
                let pixels = decode_jpeg(&bytes).map_err(|fault| Trouble::damage(index, fault))?;
                Frame::new(index, index as f64 / self.fps, pixels)
            }
        };
        if frame.size() != self.info.size {
            let (first, size) = (self.info.size, frame.size());
            let reason = format!("the picture changes from {first} to {size}; give all frames one size");
            return Err(end(Fault::malformed(reason)));
        }
        Ok(Some(frame))
    }
}

impl<R: BufRead + Send> Source for MjpegSource<R> {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_frame(&mut self) -> Result<Option<Frame>> {
        if self.finished {
            return Ok(None);
        }
        let frame = self.read_frame();
        self.finished = matches!(&frame, Ok(None)) || frame.as_ref().is_err_and(|t| !t.goes_on());
        frame.map_err(|trouble| trouble.error(&self.info.name))
    }
}

/// Whether a second image of the same size follows at once: then a file that begins like a JPEG is a video.
///
/// Telephones append further images of other sizes to a photograph; those stay one photograph.
pub(crate) fn is_stream(reader: &mut impl BufRead) -> bool {
    let Some(first) = size_of_next(reader) else { return false };
    let at_once = reader.fill_buf().is_ok_and(|bytes| bytes.starts_with(&[0xFF]));
    at_once && size_of_next(reader) == Some(first)
}

fn size_of_next(reader: &mut impl BufRead) -> Option<Size> {
    Some(JpegScan::read(&next_image(reader).ok()??).ok()?.size)
}
