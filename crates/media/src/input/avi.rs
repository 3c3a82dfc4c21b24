use super::fault::{Fault, Trouble};
use super::image::{JpegScan, decode_jpeg};
use crate::{Result, Source, SourceInfo};
use pursuit_containers::avi::AviReader;
use pursuit_containers::bytes::ReadSeek;
use pursuit_geometry::Size;
use pursuit_imaging::Frame;

/// Motion JPEG in AVI, decoded here.
///
/// A chunk without data repeats the frame before it in an AVI: it takes its time, but is not delivered twice.
pub(crate) struct AviSource {
    reader: AviReader,
    info: SourceInfo,
    next: u64,
    finished: bool,
}

impl AviSource {
    pub fn new(reader: Box<dyn ReadSeek>, name: &str) -> Result<Self, Fault> {
        let reader = AviReader::new(reader)?;
        let stream = reader.stream();
        if !matches!(&stream.codec.map(|b| b.to_ascii_uppercase()), b"MJPG" | b"JPEG") {
            return Err(Fault::unsupported(format!("the codec {} in AVI", stream.codec.escape_ascii())));
        }
        let size = Size::new(stream.size.width, stream.size.height);
        let info = SourceInfo {
            fps: Some(stream.fps),
            frame_count: Some(stream.length).filter(|&n| n > 0),
            ..SourceInfo::new(name, size, "Motion JPEG in AVI (built in)")
        };
        let mut source = Self { reader, info, next: 0, finished: false };
        source.check_first_picture()?;
        Ok(source)
    }

    /// The JPEG's own size counts, and one of half the height means that fields are stored one by one.
    fn check_first_picture(&mut self) -> Result<(), Fault> {
        if !self.reader.next_chunk()? {
            return Err(Fault::malformed("the AVI has no frames"));
        }
        let size = JpegScan::read(self.reader.chunk())?.size;
        if size.height < self.info.size.height {
            return Err(Fault::unsupported("Motion JPEG stored as fields"));
        }
        self.info.size = size;
        self.reader.rewind();
        Ok(())
    }

    fn read_frame(&mut self) -> Result<Option<Frame>, Trouble> {
        let frame = self.next;
        let end = |fault: Fault| Trouble::end(frame, fault);
        if !self.reader.next_chunk().map_err(|e| end(e.into()))? {
            return match self.info.frame_count {
                // Writers that crash leave a length of zero or of more than they wrote.
                Some(count) if self.reader.slots() < count => {
                    Err(end(Fault::malformed(format!("the file ends early ({count} frames were promised)"))))
                }
                _ => Ok(None),
            };
        }
        self.next += 1;
        let pixels = decode_jpeg(self.reader.chunk()).map_err(|fault| Trouble::damage(frame, fault))?;
        let time_s = (self.reader.slots() - 1) as f64 / self.reader.stream().fps;
        let frame = Frame::new(frame, time_s, pixels);
        if frame.size() != self.info.size {
            let (size, first) = (frame.size(), self.info.size);
            return Err(end(Fault::malformed(format!(
                "the picture changes from {first} to {size}; cut the file there"
            ))));
        }
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
        self.finished = matches!(&frame, Ok(None)) || frame.as_ref().is_err_and(|t| !t.goes_on());
        frame.map_err(|trouble| trouble.error(&self.info.name))
    }
}
