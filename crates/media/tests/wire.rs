//! Pictures for the wire: each decodes as soon as it is there, from any key frame on.
#![cfg(feature = "encode")]
#![allow(clippy::unwrap_used, clippy::expect_used)] // the helpers belong to the tests

use openh264::decoder::Decoder;
use openh264::formats::YUVSource;
use pursuit_geometry::Size;
use pursuit_imaging::{Image, Rgb8};
use pursuit_media::output::{WirePicture, h264_for_wire};

const SIZE: Size = Size { width: 322, height: 181 };

/// A smooth ramp with a bright square that moves with the frame number.
fn picture(k: usize) -> Image<Rgb8> {
    let square = |x: usize, y: usize| (40 + 3 * k..80 + 3 * k).contains(&x) && (60..100).contains(&y);
    Image::from_fn(SIZE.width, SIZE.height, |x, y| {
        if square(x, y) { [235, 235, 235] } else { [(x / 4) as u8 + 40, (x / 4) as u8 + 40, (y / 2) as u8 + 40] }
    })
    .unwrap()
}

/// Encodes thirty pictures, with a key frame wanted in those of `keys`.
fn encoded(keys: &[usize]) -> Vec<WirePicture> {
    let mut encoder = h264_for_wire(SIZE, 30.0).unwrap();
    (0..30).map(|k| encoder.encode(picture(k).view(), keys.contains(&k)).unwrap()).collect()
}

/// The largest mean difference of luma between a decoded picture and the one that was encoded, in codes.
fn worst(pictures: &[WirePicture], first: usize) -> f64 {
    let mut decoder = Decoder::new().unwrap();
    let mut worst = 0.0_f64;
    for (k, one) in pictures.iter().enumerate() {
        let decoded = decoder.decode(&one.data).unwrap().expect("nothing is held back");
        let (wide, high) = decoded.dimensions();
        assert_eq!((wide, high), (SIZE.width, 182), "sides are even");
        let source = picture(first + k);
        let stride = decoded.strides().0;
        let mut sum = 0.0;
        for y in 0..SIZE.height {
            for (x, &[r, g, b]) in source.row(y).iter().enumerate() {
                let luma =
                    16.0 + (0.2126 * f64::from(r) + 0.7152 * f64::from(g) + 0.0722 * f64::from(b)) * 219.0 / 255.0;
                sum += (f64::from(decoded.y()[y * stride + x]) - luma).abs();
            }
        }
        worst = worst.max(sum / SIZE.area() as f64);
    }
    worst
}

#[test]
fn every_picture_decodes_at_once_from_any_key_frame_on() {
    let pictures = encoded(&[11, 20]);
    let keys: Vec<usize> = (0..30).filter(|k| pictures[*k].keyframe).collect();
    assert_eq!(keys, [0, 11, 20], "the first, and those that were asked for");
    for (k, one) in pictures.iter().enumerate() {
        assert!(one.data.starts_with(&[0, 0, 0, 1]), "{k} begins with a start code");
        // H.264 table 7-1: a sequence parameter set comes first where decoding can begin.
        assert_eq!(one.data[4] & 31 == 7, one.keyframe, "{k}");
        assert_eq!(one.codec.is_some(), one.keyframe, "{k}");
    }
    let codec = pictures[0].codec.clone().unwrap();
    assert!(
        codec.len() == 11 && codec.starts_with("avc1.") && codec[5..].bytes().all(|b| b.is_ascii_hexdigit()),
        "{codec}"
    );
    for first in keys {
        let error = worst(&pictures[first..], first);
        assert!(error < 2.5, "from {first} on: {error} codes");
    }
    let (key, delta) = (pictures[11].data.len(), pictures[12].data.len());
    assert!(3 * delta < key, "{delta} bytes after {key}");
}

#[test]
fn sizes_that_cannot_be_are_said() {
    let mut encoder = h264_for_wire(SIZE, f64::NAN).unwrap();
    let other = Image::filled(64, 64, [0; 3]).unwrap();
    let message = encoder.encode(other.view(), false).unwrap_err().to_string();
    assert!(message.contains("322") && message.contains("64"), "{message}");
    let message = h264_for_wire(Size::new(20_000, 20_000), 30.0).err().unwrap().to_string();
    assert!(message.contains("larger than the encoder's"), "{message}");
}
