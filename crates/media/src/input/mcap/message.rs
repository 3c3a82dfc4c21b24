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

    /// The time that a message says its picture was taken at, in nanoseconds, and the picture still as bytes.
    pub fn read<'a>(&self, bytes: &'a [u8]) -> Result<(i64, Picture<'a>), Fault> {
        self.fields(bytes)
            .ok_or_else(|| Fault::malformed("the message is cut off or of another type than its channel says"))
    }

    fn fields<'a>(&self, bytes: &'a [u8]) -> Option<(i64, Picture<'a>)> {
        let mut reader = Reader::new(bytes, self.form)?;
        match self.kind {
            Kind::Image => {
                let stamp_ns = reader.header()?;
                let (height, width) = (reader.u32()?, reader.u32()?);
                let encoding = reader.text()?;
                let (big_endian, step) = (reader.u8()? != 0, reader.u32()?);
                let data = reader.bytes()?;
                Some((stamp_ns, Picture::Raw(Raw { width, height, encoding, big_endian, step, data })))
            }
            Kind::Compressed => {
                let stamp_ns = reader.header()?;
                reader.bytes()?;
                Some((stamp_ns, Picture::Compressed(reader.bytes()?)))
            }
            Kind::FoxgloveRaw => {
                let stamp_ns = reader.time()?;
                reader.bytes()?;
                let (width, height) = (reader.u32()?, reader.u32()?);
                let encoding = reader.text()?;
                let step = reader.u32()?;
                Some((
                    stamp_ns,
                    Picture::Raw(Raw { width, height, encoding, big_endian: false, step, data: reader.bytes()? }),
                ))
            }
            Kind::FoxgloveCompressed => {
                let stamp_ns = reader.time()?;
                reader.bytes()?;
                Some((stamp_ns, Picture::Compressed(reader.bytes()?)))
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const TYPES: [&str; 4] = [
        "sensor_msgs/msg/Image",
        "sensor_msgs/CompressedImage",
        "foxglove_msgs/msg/RawImage",
        "foxglove_msgs/CompressedImage",
    ];

    #[test]
    fn images_are_known_by_type_and_encoding() {
        assert!(
            TYPES.iter().all(|schema| Reading::of(schema, "cdr").is_some() && Reading::of(schema, "ros1").is_some())
        );
        assert_eq!(Reading::of("sensor_msgs/msg/PointCloud2", "cdr"), None);
        assert_eq!(Reading::of("sensor_msgs/msg/Image", "json"), None);
    }

    #[test]
    fn foxglove_pictures_are_read() {
        let mut bytes = vec![0, 1, 0, 0, 2, 0, 0, 0, 5, 0, 0, 0, 2, 0, 0, 0, b'c', 0, 0, 0];
        bytes.extend([2, 0, 0, 0, 1, 0, 0, 0, 6, 0, 0, 0]);
        bytes.extend(b"mono8\0\0\0");
        bytes.extend([2, 0, 0, 0, 2, 0, 0, 0, 7, 8]);
        let reading = Reading::of("foxglove_msgs/msg/RawImage", "cdr").unwrap();
        let (stamp_ns, picture) = reading.read(&bytes).unwrap();
        let Picture::Raw(raw) = picture else { panic!("it is raw") };
        assert_eq!(
            (stamp_ns, raw.width, raw.height, raw.encoding, raw.data),
            (2_000_000_005, 2, 1, "mono8", &[7, 8][..])
        );
        assert!(picture.decode().is_ok());
    }

    proptest! {
        #[test]
        fn any_message_does_no_harm(
            bytes in prop::collection::vec(prop_oneof![3 => Just(0_u8), 1 => any::<u8>()], 0..300),
            schema in prop::sample::select(&TYPES[..]),
            encoding in prop::sample::select(vec!["cdr", "ros1"]),
        ) {
            let reading = Reading::of(schema, encoding).unwrap();
            if let Ok((_, picture)) = reading.read(&bytes) {
                let _ = picture.decode();
            }
        }
    }
}
