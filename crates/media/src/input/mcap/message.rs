//! Messages that are images.

use super::cdr::{Form, Reader};
use super::raw::{self, Raw};
use crate::input::fault::Fault;
use crate::input::image::decode_image;
use pursuit_imaging::Pixels;

/// What kind of message it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// `sensor_msgs/Image`.
    Image,
    /// `sensor_msgs/CompressedImage`.
    Compressed,
    /// `foxglove_msgs/RawImage`.
    FoxgloveRaw,
    /// `foxglove_msgs/CompressedImage`.
    FoxgloveCompressed,
}

/// How the messages of a channel are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Reading {
    pub kind: Kind,
    pub form: Form,
}

impl Reading {
    /// How messages of this type and encoding are read, where they are images.
    pub fn of(schema: &str, encoding: &str) -> Option<Self> {
        let form = match encoding {
            "cdr" => Form::Ros2,
            "ros1" => Form::Ros1,
            _ => return None,
        };
        let kind = match schema.replace("/msg/", "/").as_str() {
            "sensor_msgs/Image" => Kind::Image,
            "sensor_msgs/CompressedImage" => Kind::Compressed,
            "foxglove_msgs/RawImage" => Kind::FoxgloveRaw,
            "foxglove_msgs/CompressedImage" => Kind::FoxgloveCompressed,
            _ => return None,
        };
        Some(Self { kind, form })
    }

    /// The time that a message says it was taken at, seconds, and its picture still as bytes.
    pub fn read<'a>(&self, bytes: &'a [u8]) -> Result<(f64, Picture<'a>), Fault> {
        self.fields(bytes)
            .ok_or_else(|| Fault::malformed("the message is cut off or of another type than its channel says"))
    }

    fn fields<'a>(&self, bytes: &'a [u8]) -> Option<(f64, Picture<'a>)> {
        let mut reader = Reader::new(bytes, self.form)?;
        match self.kind {
            Kind::Image => {
                let stamp_s = reader.header()?;
                let (height, width) = (reader.u32()?, reader.u32()?);
                let encoding = reader.text()?;
                let (big_endian, step) = (reader.u8()? != 0, reader.u32()?);
                let data = reader.bytes()?;
                Some((stamp_s, Picture::Raw(Raw { width, height, encoding, big_endian, step, data })))
            }
            Kind::Compressed => {
                let stamp_s = reader.header()?;
                reader.text()?;
                Some((stamp_s, Picture::Compressed(reader.bytes()?)))
            }
            Kind::FoxgloveRaw => {
                let stamp_s = reader.time()?;
                reader.text()?;
                let (width, height) = (reader.u32()?, reader.u32()?);
                let encoding = reader.text()?;
                let step = reader.u32()?;
                Some((
                    stamp_s,
                    Picture::Raw(Raw { width, height, encoding, big_endian: false, step, data: reader.bytes()? }),
                ))
            }
            Kind::FoxgloveCompressed => {
                let stamp_s = reader.time()?;
                reader.text()?;
                Some((stamp_s, Picture::Compressed(reader.bytes()?)))
            }
        }
    }
}

/// A picture as a message holds it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Picture<'a> {
    Raw(Raw<'a>),
    /// JPEG or PNG.
    Compressed(&'a [u8]),
}

impl Picture<'_> {
    pub fn decode(&self) -> Result<Pixels, Fault> {
        match self {
            Self::Raw(raw) => raw::decode(raw),
            Self::Compressed(bytes) => decode_image(bytes),
        }
    }
}
