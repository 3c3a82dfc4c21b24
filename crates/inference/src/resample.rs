//! Bilinear resampling in whole grey levels, as networks were trained on: the arithmetic of OpenCV's `resize`, to the last digit.

use multiversion::multiversion;
use pursuit_imaging::{ImageView, Rgb8};

/// Bits of the fraction in which a pixel's weight is kept.
const BITS: u32 = 11;
const ONE: i32 = 1 << BITS;

/// A rectangle of whole pixels, which may reach over the image's border.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    pub left: i64,
    pub top: i64,
    pub width: i64,
    pub height: i64,
}

/// How exactly it is told where a sample lies.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Places {
    /// In single precision, as OpenCV does.
    #[default]
    Single,
    /// In double precision: one weight in some hundred is another, and one grey level in a thousand.
    Double,
}

/// A row in three planes.
type Planes<T> = [Vec<T>; 3];

/// Its places, and scratch.
#[derive(Debug, Clone, Default)]
pub struct Resampler {
    places: Places,
    columns: Columns,
    /// The two rows of the image between which a row lies, resampled horizontally, with their numbers in the window.
    rows: [(i64, Planes<i32>); 2],
    pixels: Planes<f32>,
}

/// Which pixels of a row go into each sample. Where the window reaches over the image, a row is continued by two pixels
/// of the fill on that side, to which all others there are equal.
#[derive(Debug, Clone, Default)]
struct Columns {
    /// First pixel of the row that is looked at, counted from the first of the image.
    start: i64,
    /// How many pixels are looked at.
    len: usize,
    /// For each sample the first of its two pixels, counted in bytes from `start`, and the weight of the second.
    offsets: Vec<usize>,
    weights: Vec<i32>,
    /// A row with its continuation.
    strip: Vec<u8>,
    /// For each sample four bytes from its first and from its second pixel on.
    firsts: Vec<u32>,
    seconds: Vec<u32>,
}

/// Two neighbours and the weight of the second, in 1/2048.
#[derive(Debug, Clone, Copy)]
struct Tap {
    first: i64,
    second: i64,
    weight: i32,
}

impl Tap {
    /// Sample `i` of `samples` from a row of `side` pixels: pixel centres at half-integers, the border replicated.
    fn across(places: Places, i: usize, samples: usize, side: i64) -> Self {
        Self::at(places.of(i, samples, side).clamp(0.0, (side - 1) as f64), side)
    }

    /// The same from a column. At the border it weighs one pixel twice instead of once, which rounds differently: so
    /// does OpenCV.
    fn down(places: Places, i: usize, samples: usize, side: i64) -> Self {
        Self::at(places.of(i, samples, side), side)
    }

    fn at(place: f64, side: i64) -> Self {
        let first = place.floor();
        let weight = ((place - first) * f64::from(ONE)).round_ties_even() as i32;
        let inside = |pixel: i64| pixel.clamp(0, side - 1);
        Self { first: inside(first as i64), second: inside(first as i64 + 1), weight }
    }
}

impl Places {
    /// Where sample `i` of `samples` lies among `side` pixels.
    fn of(self, i: usize, samples: usize, side: i64) -> f64 {
        match self {
            Self::Single => {
                let scale = 1.0 / (samples as f64 / side as f64);
                f64::from(((i as f64 + 0.5) * scale - 0.5) as f32)
            }
            Self::Double => (i as f64 + 0.5) * side as f64 / samples as f64 - 0.5,
        }
    }
}

impl Resampler {
    /// With such places.
    pub fn new(places: Places) -> Self {
        Self { places, ..Self::default() }
    }

    /// Resamples `window` of `image` to `columns` × `rows` and hands over row after row in three planes, in the order of
    /// the image's channels; what lies outside the image is `fill`.
    pub fn resample(
        &mut self,
        image: ImageView<'_, Rgb8>,
        window: Window,
        (columns, rows): (usize, usize),
        fill: Rgb8,
        mut row: impl FnMut(usize, [&mut [f32]; 3]),
    ) {
        self.columns.place(self.places, window, columns, image.width());
        for (number, planes) in &mut self.rows {
            *number = -1;
            planes.iter_mut().for_each(|plane| plane.resize(columns, 0));
        }
        self.pixels.iter_mut().for_each(|plane| plane.resize(columns, 0.0));
        for y in 0..rows {
            let tap = Tap::down(self.places, y, rows, window.height);
            self.make_rows(image, window.top, (tap.first, tap.second), fill);
            let [(_, upper), (_, lower)] = &self.rows;
            for ((upper, lower), out) in upper.iter().zip(lower).zip(&mut self.pixels) {
                blend(upper, lower, tap.weight, out);
            }
            row(y, self.pixels.each_mut().map(Vec::as_mut_slice));
        }
    }

    /// Makes rows `first` and `second` of the window the two rows that are kept.
    fn make_rows(&mut self, image: ImageView<'_, Rgb8>, top: i64, (first, second): (i64, i64), fill: Rgb8) {
        if self.rows[1].0 == first {
            self.rows.swap(0, 1);
        }
        for ((kept, planes), number) in self.rows.iter_mut().zip([first, second]) {
            if *kept != number {
                let y = usize::try_from(top + number).ok().filter(|&y| y < image.height());
                self.columns.resample(y.map_or(&[][..], |y| image.row(y)), fill, planes);
                *kept = number;
            }
        }
    }
}

impl Columns {
    /// Pixels of the fill on either side of a row.
    const MARGIN: i64 = 2;

    /// For `samples` samples of `window`, in rows of `width` pixels.
    fn place(&mut self, places: Places, window: Window, samples: usize, width: usize) {
        let taps = (0..samples).map(|i| Tap::across(places, i, samples, window.width));
        let pixel = |tap: Tap| (window.left + tap.first).clamp(-Self::MARGIN, width as i64);
        self.start = taps.clone().next().map_or(0, pixel);
        // The second pixel is the next one; at the right border, where there is none, it has no weight.
        self.len = taps.clone().next_back().map_or(0, |tap| (pixel(tap) - self.start) as usize + 2);
        self.offsets.clear();
        self.offsets.extend(taps.clone().map(|tap| 3 * (pixel(tap) - self.start) as usize));
        self.weights.clear();
        self.weights.extend(taps.map(|tap| tap.weight));
        self.firsts.resize(samples, 0);
        self.seconds.resize(samples, 0);
    }

    /// A row, or that of the fill if it is empty, at the samples, times 2048.
    fn resample(&mut self, row: &[Rgb8], fill: Rgb8, out: &mut Planes<i32>) {
        let inside = usize::try_from(self.start).ok().and_then(|start| row.get(start..start + self.len + 1));
        let bytes = match inside {
            Some(inside) => inside.as_flattened(),
            None => {
                self.continue_row(row, fill);
                &self.strip
            }
        };
        let pairs = self.firsts.iter_mut().zip(&mut self.seconds);
        for ((first, second), &offset) in pairs.zip(&self.offsets) {
            let Some(two) = bytes[offset..].first_chunk::<7>() else {
                unreachable!("a row has a byte behind the two pixels of its last sample")
            };
            let [a, b, c, d, e, f, g] = *two;
            (*first, *second) = (u32::from_le_bytes([a, b, c, d]), u32::from_le_bytes([d, e, f, g]));
        }
        for (c, out) in out.iter_mut().enumerate() {
            weigh(&self.firsts, &self.seconds, &self.weights, 8 * c as u32, out);
        }
    }

    /// Writes the part of the row that is looked at, with what continues it, to `strip`.
    fn continue_row(&mut self, row: &[Rgb8], fill: Rgb8) {
        let pixels = self.len + 1;
        let inside = |x: i64| x.clamp(0, row.len() as i64) as usize;
        let of_row = &row[inside(self.start)..inside(self.start + pixels as i64)];
        let before = usize::try_from(-self.start).unwrap_or(0).min(pixels);
        self.strip.clear();
        (0..before).for_each(|_| self.strip.extend_from_slice(&fill));
        self.strip.extend_from_slice(of_row.as_flattened());
        (before + of_row.len()..pixels).for_each(|_| self.strip.extend_from_slice(&fill));
    }
}

/// One channel, `shift` bits into the pixels, of all samples.
#[multiversion(targets("x86_64+avx2", "aarch64+neon"))]
fn weigh(firsts: &[u32], seconds: &[u32], weights: &[i32], shift: u32, out: &mut [i32]) {
    for (((out, first), second), weight) in out.iter_mut().zip(firsts).zip(seconds).zip(weights) {
        let level = |pixel: &u32| (pixel >> shift & 255) as i32;
        *out = level(first) * ONE + (level(second) - level(first)) * weight;
    }
}

/// The row between two that are resampled horizontally.
#[multiversion(targets("x86_64+avx2", "aarch64+neon"))]
fn blend(upper: &[i32], lower: &[i32], weight: i32, out: &mut [f32]) {
    for (out, (&upper, &lower)) in out.iter_mut().zip(upper.iter().zip(lower)) {
        *out = between(upper, lower, weight) as f32;
    }
}

/// Between two sums in 1/2048, to the nearest whole number: in 16-bit steps, as the library does with which the networks
/// were trained, so that the same grey levels come out.
#[inline(always)]
const fn between(upper: i32, lower: i32, weight: i32) -> i32 {
    ((((upper >> 4) * (ONE - weight)) >> 16) + (((lower >> 4) * weight) >> 16) + 2) >> 2
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_imaging::Image;

    /// One sample, pixel by pixel.
    fn sample(
        image: ImageView<'_, Rgb8>,
        window: Window,
        samples: usize,
        (x, y): (usize, usize),
        fill: Rgb8,
    ) -> [f32; 3] {
        let (across, down) = (
            Tap::across(Places::Single, x, samples, window.width),
            Tap::down(Places::Single, y, samples, window.height),
        );
        let pixel = |x: i64, y: i64| {
            let inside = |v: i64, most: usize| usize::try_from(v).ok().filter(|&v| v < most);
            let (x, y) = (inside(window.left + x, image.width()), inside(window.top + y, image.height()));
            x.zip(y).map_or(fill, |(x, y)| image.row(y)[x])
        };
        std::array::from_fn(|c| {
            let row = |y: i64| {
                let [a, b] = [across.first, across.second].map(|x| i32::from(pixel(x, y)[c]));
                a * (ONE - across.weight) + b * across.weight
            };
            between(row(down.first), row(down.second), down.weight) as f32
        })
    }

    #[test]
    fn places_are_rounded_as_opencv_rounds_them() {
        // cv2.resize of 21 pixels to 271: sample 227 lies 265.5 / 2048 behind pixel 17, which single precision makes a little less of.
        let image = Image::from_fn(21, 1, |x, _| [if x == 17 { 255 } else { 3 }; 3]).unwrap();
        let window = Window { left: 0, top: 0, width: 21, height: 1 };
        for (places, level) in [(Places::Single, 223.0), (Places::Double, 222.0)] {
            let mut row = Vec::new();
            let mut resampler = Resampler::new(places);
            resampler.resample(image.view(), window, (271, 1), [0; 3], |_, planes| row = planes[0].to_vec());
            assert_eq!(row[227], level, "{places:?}");
        }
    }

    #[test]
    fn windows_anywhere_are_what_their_pixels_make_them() {
        let mut resampler = Resampler::default();
        for (width, height) in [(13, 9), (1, 1), (2, 40)] {
            let pixel = |x: usize, y: usize| [(x * 37 + y * 11) as u8, (x * x + 90 * y) as u8, (200 + x * 5 * y) as u8];
            let image = Image::from_fn(width, height, pixel).unwrap();
            let fill = [7, 99, 201];
            for (left, top, side) in [
                (0, 0, 9),
                (2, 1, 5),
                (-3, -2, 8),
                (9, 6, 7),
                (-20, -30, 60),
                (-1, -1, 2),
                (-2, 0, 3),
                (12, 8, 1),
                (13, 9, 4),
                (500, 0, 9),
                (0, -500, 9),
                (-1_000_000_000_000, 3, 1_000_000),
                (-400_000, -400_000, 1_000_000),
                (5, 5, 1),
            ] {
                let window = Window { left, top, width: side, height: side };
                for samples in [1, 2, 5, 16, 33] {
                    resampler.resample(image.view(), window, (samples, samples), fill, |y, planes| {
                        for x in 0..samples {
                            let want = sample(image.view(), window, samples, (x, y), fill);
                            let got = planes.each_ref().map(|plane| plane[x]);
                            assert_eq!(got, want, "{width} x {height}, {window:?}, sample {x}, {y} of {samples}");
                        }
                    });
                }
            }
        }
    }
}
