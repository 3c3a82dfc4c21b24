//! Pixels as `sensor_msgs/Image` holds them.

use crate::input::fault::Fault;
use pursuit_imaging::{Image, Pixels, Rgb8, SharedImage};

/// An image and how its bytes are meant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Raw<'a> {
    pub width: u32,
    pub height: u32,
    /// As in `sensor_msgs/image_encodings`.
    pub encoding: &'a str,
    pub big_endian: bool,
    /// Bytes from one row to the next.
    pub step: u32,
    pub data: &'a [u8],
}

impl Raw<'_> {
    /// The byte at a place of a row; `decode` has seen that there are as many.
    fn byte(&self, row: usize, at: usize) -> u8 {
        self.data.get(row * self.step as usize + at).copied().unwrap_or(0)
    }

    /// All pixels, each made of its `N` bytes.
    fn pixels<const N: usize, P>(&self, pixel: impl Fn([u8; N]) -> P) -> Result<Image<P>, Fault> {
        let (width, height) = self.check(N)?;
        // The size is checked against the bytes that there are.
        let mut pixels = Vec::with_capacity(width * height);
        for row in self.data.chunks(self.step.max(1) as usize).take(height) {
            pixels.extend(row.as_chunks().0.iter().take(width).map(|bytes| pixel(*bytes)));
        }
        Image::from_vec(pixels, width, height).map_err(Fault::from)
    }

    fn check(&self, bytes_per_pixel: usize) -> Result<(usize, usize), Fault> {
        let (width, height, step) = (self.width as usize, self.height as usize, self.step as usize);
        if step < width.saturating_mul(bytes_per_pixel) {
            return Err(Fault::malformed(format!(
                "a row of {width} pixels of {} takes more than {step} bytes",
                self.encoding
            )));
        }
        // The last row need not be filled up.
        let needed = height.saturating_sub(1).saturating_mul(step).saturating_add(width * bytes_per_pixel);
        if self.data.len() < needed {
            let found = self.data.len();
            return Err(Fault::malformed(format!(
                "{width}x{height} pixels take {needed} bytes, and there are {found}"
            )));
        }
        Ok((width, height))
    }
}

/// Where red stands in each two by two pixels of a colour filter: column and row.
fn red_at(encoding: &str) -> Option<(usize, usize)> {
    match encoding {
        "bayer_rggb8" => Some((0, 0)),
        "bayer_grbg8" => Some((1, 0)),
        "bayer_gbrg8" => Some((0, 1)),
        "bayer_bggr8" => Some((1, 1)),
        _ => None,
    }
}

pub(super) fn decode(raw: &Raw<'_>) -> Result<Pixels, Fault> {
    let color = |image: Result<Image<Rgb8>, Fault>| image.map(|image| Pixels::Rgb8(SharedImage::from(image)));
    match raw.encoding {
        "rgb8" | "8UC3" => color(raw.pixels(|rgb: [u8; 3]| rgb)),
        "bgr8" => color(raw.pixels(|[b, g, r]| [r, g, b])),
        "rgba8" | "8UC4" => color(raw.pixels(|[r, g, b, _]| [r, g, b])),
        "bgra8" => color(raw.pixels(|[b, g, r, _]| [r, g, b])),
        "mono8" | "8UC1" => Ok(Pixels::Gray8(SharedImage::from(raw.pixels(|[value]| value)?))),
        "mono16" | "16UC1" => {
            let of_bytes = if raw.big_endian { u16::from_be_bytes } else { u16::from_le_bytes };
            Ok(Pixels::Gray16(SharedImage::from(raw.pixels(of_bytes)?)))
        }
        "yuv422" | "uyvy" => color(yuv422(raw, [1, 0, 2])),
        "yuv422_yuy2" | "yuyv" => color(yuv422(raw, [0, 1, 3])),
        other => match red_at(other) {
            Some(red) => color(unfiltered(raw, red)),
            None => Err(Fault::malformed(format!(
                "images of the encoding `{other}` are not read; publish them as rgb8, bgr8, mono8, mono16, JPEG or PNG"
            ))),
        },
    }
}

/// Two pixels in four bytes: where the first brightness stands (the second two bytes later), and both colour differences.
fn yuv422(raw: &Raw<'_>, [luma, blue, red]: [usize; 3]) -> Result<Image<Rgb8>, Fault> {
    let (width, height) = raw.check(2)?;
    let pixel = |x: usize, y: usize| {
        let pair = x / 2 * 4;
        let value = |at: usize| f32::from(raw.byte(y, pair + at));
        // BT.601, from 16 to 235.
        let (l, b, r) = (1.164 * (value(luma + 2 * (x % 2)) - 16.0), value(blue) - 128.0, value(red) - 128.0);
        [l + 1.596 * r, l - 0.813 * r - 0.391 * b, l + 2.018 * b].map(|v| v.round().clamp(0.0, 255.0) as u8)
    };
    Ok(Image::from_fn(width, height, pixel)?)
}

/// Colours behind a colour filter: of each the mean of the nearest, of a pixel's own what it is.
fn unfiltered(raw: &Raw<'_>, (red_x, red_y): (usize, usize)) -> Result<Image<Rgb8>, Fault> {
    let (width, height) = raw.check(1)?;
    let channel_of = |column: usize, row: usize| match ((column + red_x) % 2, (row + red_y) % 2) {
        (0, 0) => 0,
        (1, 1) => 2,
        _ => 1,
    };
    let pixel = |x: usize, y: usize| {
        let (mut sums, mut counts) = ([0_u32; 3], [0_u32; 3]);
        for row in y.saturating_sub(1)..(y + 2).min(height) {
            for column in x.saturating_sub(1)..(x + 2).min(width) {
                let channel = channel_of(column, row);
                sums[channel] += u32::from(raw.byte(row, column));
                counts[channel] += 1;
            }
        }
        let mut color: Rgb8 = std::array::from_fn(|channel| (sums[channel] / counts[channel].max(1)) as u8);
        color[channel_of(x, y)] = raw.byte(y, x);
        color
    };
    Ok(Image::from_fn(width, height, pixel)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_imaging::Frame;

    fn raw<'a>(encoding: &'a str, (width, height, step): (u32, u32, u32), data: &'a [u8]) -> Raw<'a> {
        Raw { width, height, encoding, big_endian: false, step, data }
    }

    fn first(encoding: &str, data: &[u8], size: (u32, u32, u32)) -> Rgb8 {
        Frame::new(0, 0.0, decode(&raw(encoding, size, data)).unwrap()).color().row(0)[0]
    }

    #[test]
    fn every_order_of_bytes_gives_the_same_colour() {
        assert_eq!(first("rgb8", &[1, 2, 3], (1, 1, 3)), [1, 2, 3]);
        assert_eq!(first("bgr8", &[3, 2, 1], (1, 1, 3)), [1, 2, 3]);
        assert_eq!(first("rgba8", &[1, 2, 3, 9], (1, 1, 4)), [1, 2, 3]);
        assert_eq!(first("bgra8", &[3, 2, 1, 9], (1, 1, 4)), [1, 2, 3]);
        assert_eq!(first("mono8", &[7], (1, 1, 1)), [7, 7, 7]);
        // Grey is grey in every form of YUV.
        assert_eq!(first("uyvy", &[128, 126, 128, 126], (2, 1, 4)), first("yuyv", &[126, 128, 126, 128], (2, 1, 4)));
    }

    #[test]
    fn a_colour_filter_is_taken_apart() {
        // Red everywhere: only the red pixels see it.
        let data = [200, 0, 200, 0, 0, 0, 0, 0, 200, 0, 200, 0, 0, 0, 0, 0];
        let image = decode(&raw("bayer_rggb8", (4, 4, 4), &data)).unwrap();
        let frame = Frame::new(0, 0.0, image);
        assert_eq!((frame.color().row(0)[0], frame.color().row(1)[1]), ([200, 0, 0], [200, 0, 0]));
        // The filter begins where its name says.
        let bytes = [1, 2, 3, 4];
        for (encoding, expected) in [
            ("bayer_rggb8", [1, 2, 4]),
            ("bayer_grbg8", [2, 1, 3]),
            ("bayer_gbrg8", [3, 1, 2]),
            ("bayer_bggr8", [4, 2, 1]),
        ] {
            let frame = Frame::new(0, 0.0, decode(&raw(encoding, (2, 2, 2), &bytes)).unwrap());
            assert_eq!(frame.color().row(0)[0], expected, "{encoding}");
        }
    }

    #[test]
    fn rows_may_be_padded_and_the_last_need_not_be() {
        let data = [1, 99, 2];
        let Pixels::Gray8(image) = decode(&raw("mono8", (1, 2, 2), &data)).unwrap() else { panic!("it is grey") };
        assert_eq!((image.view().row(0)[0], image.view().row(1)[0]), (1, 2));
        let Pixels::Gray16(image) = decode(&Raw { big_endian: true, ..raw("mono16", (1, 1, 2), &[1, 2]) }).unwrap()
        else {
            panic!("it is 16-bit")
        };
        assert_eq!(image.view().row(0)[0], 258);
    }

    #[test]
    fn what_does_not_fit_is_an_error() {
        for (encoding, size) in [
            ("rgb8", (2, 1, 3)),
            ("rgb8", (1, 2, 3)),
            ("mono8", (0, 0, 0)),
            ("hsv", (1, 1, 3)),
            ("rgb8", (u32::MAX, u32::MAX, u32::MAX)),
        ] {
            assert!(decode(&raw(encoding, size, &[0; 3])).is_err(), "{encoding}");
        }
    }
}
