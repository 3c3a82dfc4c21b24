//! RTSP (RFC 2326, RFC 7826) over TCP in this process, by the crate `retina`: H.264 and Motion JPEG, decoded here.

mod reorder;
mod session;

use super::cancel::Cancel;
use super::fault::{Fault, Trouble};
use super::h264::PictureDecoder;
use super::image::decode_image;
use super::orientation::Orientation;
use super::source::StopHandle;
use crate::{Result, Source, SourceInfo};
use pursuit_address::Locator;
use pursuit_containers::mp4::AvcConfig;
use pursuit_imaging::{Frame, Pixels};
use reorder::Reorder;
pub(crate) use session::Coding;
use session::{Sample, Session};

/// Bytes of the length before each H.264 unit.
const LENGTH_BYTES: usize = 4;

/// Pictures of a camera, in the order they are shown.
pub(crate) struct RtspSource {
    session: Session,
    decoder: Decoder,
    reorder: Reorder<Pixels>,
    info: SourceInfo,
    next: u64,
    /// The time stamp of the first picture, seconds.
    origin_s: Option<f64>,
    finished: bool,
}

enum Decoder {
    H264 {
        /// From the first sample on that has parameters.
        pictures: Option<Box<PictureDecoder>>,
        /// Whether the next sample that needs no other is waited for.
        waiting: bool,
    },
    Jpeg,
}

impl RtspSource {
    /// Connects, and waits for the first picture.
    pub fn open(locator: &Locator, live: bool, cancel: &Cancel) -> Result<Self, Fault> {
        let mut session = Session::open(locator, cancel)?;
        let (mut decoder, name) = match session.coding() {
            Coding::H264 => (Decoder::H264 { pictures: None, waiting: true }, "H.264"),
            Coding::Jpeg => (Decoder::Jpeg, "Motion JPEG"),
        };
        let mut reorder = Reorder::default();
        // What a source is, its first picture says.
        let size = loop {
            let Some(sample) = session.next()? else { return Err(Fault::malformed("no picture came")) };
            match decoder.decode(&sample) {
                Ok(Some(pixels)) => {
                    let size = pixels.size();
                    reorder.push(sample.time, pixels);
                    break size;
                }
                Err(fault @ Fault::Unsupported(_)) => return Err(fault),
                Ok(None) | Err(Fault::Malformed(_)) => {}
            }
        };
        let info = SourceInfo {
            fps: session.fps(),
            live,
            ..SourceInfo::new(locator.to_string(), size, format!("{name} by RTSP (built in)"))
        };
        Ok(Self { session, decoder, reorder, info, next: 0, origin_s: None, finished: false })
    }

    fn read(&mut self) -> Result<Option<Frame>, Trouble> {
        loop {
            if let Some((time, pixels)) = self.reorder.pop() {
                let time_s = time as f64 / self.session.clock_rate();
                let time_s = time_s - *self.origin_s.get_or_insert(time_s);
                let index = self.next;
                self.next += 1;
                return Ok(Some(Frame::new(index, time_s, pixels)));
            }
            let sample = match self.session.next() {
                Ok(Some(sample)) => sample,
                // A camera does not end.
                Ok(None) => return Err(Trouble::end(self.next, Fault::malformed("the stream ended"))),
                Err(fault) => return Err(Trouble::end(self.next, fault)),
            };
            match self.decoder.decode(&sample) {
                Ok(Some(pixels)) => self.reorder.push(sample.time, pixels),
                Ok(None) => {}
                Err(fault @ Fault::Malformed(_)) => return Err(Trouble::damage(self.next, fault)),
                Err(fault) => return Err(Trouble::end(self.next, fault)),
            }
        }
    }
}

impl Decoder {
    /// The picture of a sample; `None` while a picture is waited for that needs none before it.
    fn decode(&mut self, sample: &Sample) -> Result<Option<Pixels>, Fault> {
        let Self::H264 { pictures, waiting } = self else { return decode_image(&sample.data).map(Some) };
        if sample.lost {
            *waiting = true;
        }
        if *waiting && !sample.is_entry {
            return if sample.lost { Err(Fault::malformed("packets were lost")) } else { Ok(None) };
        }
        let decoder = match pictures {
            Some(decoder) => decoder,
            None => {
                let config = AvcConfig { length_bytes: LENGTH_BYTES, ..AvcConfig::default() };
                pictures.insert(Box::new(PictureDecoder::new(config, Orientation::default(), &sample.data)?))
            }
        };
        if std::mem::take(waiting) {
            decoder.restart();
        }
        let picture = decoder.decode(&sample.data).inspect_err(|_| *waiting = true)?;
        Ok(picture.map(Pixels::from))
    }
}

impl Source for RtspSource {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_frame(&mut self) -> Result<Option<Frame>> {
        if self.finished {
            return Ok(None);
        }
        self.read().map_err(|trouble| {
            self.finished = !trouble.goes_on();
            trouble.error(&self.info.name)
        })
    }

    fn stop_handle(&self) -> Option<StopHandle> {
        Some(self.session.stop_handle())
    }
}
