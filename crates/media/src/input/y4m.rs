use super::color::ColorInfo;
use super::fault::Fault;
use super::source::not_square;
use crate::{Result, Source, SourceInfo};
use pursuit_containers::limits::Extent;
use pursuit_containers::y4m::{Planes, Y4mReader};
use pursuit_geometry::Size;
use pursuit_imaging::{Frame, Image, Pixels, Yuv420};
use std::io::BufRead;

/// The picture of one frame's samples, with what is known about colour.
pub(crate) fn pixels(planes: Planes, size: Extent, color: ColorInfo) -> Result<Pixels, Fault> {
    let Extent { width, height } = size;
    Ok(match planes {
        Planes::Gray8(data) => Image::from_vec(data, width, height)?.into(),
        Planes::Gray16(data) => Image::from_vec(data, width, height)?.into(),
        Planes::Yuv420([y, u, v]) => {
            let chroma = |data| Image::from_vec(data, width.div_ceil(2), height.div_ceil(2));
            let (matrix, range) = color.resolve(Size::new(width, height));
            Pixels::Yuv420(Yuv420::new(Image::from_vec(y, width, height)?, chroma(u)?, chroma(v)?, matrix, range)?)
        }
    })
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
        let size = Size::new(header.size.width, header.size.height);
        let info = SourceInfo {
            fps: header.fps,
            frame_count: file_len.and_then(|len| header.frames_in(len)),
            pixel_aspect: not_square(header.pixel_aspect),
            ..SourceInfo::new(name, size, "Y4M (built in)")
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
        let color = ColorInfo::of_range(self.reader.header.full_range);
        let size = self.reader.header.size;
        let planes = self.reader.next_planes().map_err(Fault::from);
        match planes.and_then(|planes| planes.map(|p| pixels(p, size, color)).transpose()) {
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
