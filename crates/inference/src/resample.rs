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

/// Scratch.
#[derive(Debug, Clone, Default)]
pub struct Resampler {
    columns: Vec<Tap>,
    /// The two rows of the image between which a row lies, resampled horizontally, with their numbers in the window.
    rows: [(i64, Vec<[i32; 3]>); 2],
    pixels: Vec<[f32; 3]>,
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
    fn across(i: usize, samples: usize, side: i64) -> Self {
        Self::at(place(i, samples, side).clamp(0.0, (side - 1) as f64), side)
    }

    /// The same from a column. At the border it weighs one pixel twice instead of once, which rounds differently: so
    /// does OpenCV.
    fn down(i: usize, samples: usize, side: i64) -> Self {
        Self::at(place(i, samples, side), side)
    }

    fn at(place: f64, side: i64) -> Self {
        let first = place.floor();
        let weight = ((place - first) * f64::from(ONE)).round_ties_even() as i32;
        let inside = |pixel: i64| pixel.clamp(0, side - 1);
        Self { first: inside(first as i64), second: inside(first as i64 + 1), weight }
    }
}

/// Where sample `i` of `samples` lies among `side` pixels.
fn place(i: usize, samples: usize, side: i64) -> f64 {
    (i as f64 + 0.5) * side as f64 / samples as f64 - 0.5
}

impl Resampler {
    /// Resamples `window` of `image` to `columns` × `rows` and hands over row after row; what lies outside the image is `fill`.
    pub fn resample(
        &mut self,
        image: ImageView<'_, Rgb8>,
        window: Window,
        (columns, rows): (usize, usize),
        fill: Rgb8,
        mut row: impl FnMut(usize, &mut [[f32; 3]]),
    ) {
        self.columns.clear();
        self.columns.extend((0..columns).map(|i| Tap::across(i, columns, window.width)));
        self.columns.iter_mut().for_each(|tap| {
            tap.first += window.left;
            tap.second += window.left;
        });
        self.rows.iter_mut().for_each(|(number, row)| {
            *number = -1;
            row.resize(columns, [0; 3]);
        });
        self.pixels.resize(columns, [0.0; 3]);
        for y in 0..rows {
            let tap = Tap::down(y, rows, window.height);
            self.make_row(image, window.top, tap.first, tap.second, fill);
            blend(&self.rows[0].1, &self.rows[1].1, tap.weight, &mut self.pixels);
            row(y, &mut self.pixels);
        }
    }

    /// Makes rows `first` and `second` of the window the two rows that are kept.
    fn make_row(&mut self, image: ImageView<'_, Rgb8>, top: i64, first: i64, second: i64, fill: Rgb8) {
        if self.rows[1].0 == first {
            self.rows.swap(0, 1);
        }
        for (slot, number) in [(0, first), (1, second)] {
            if self.rows[slot].0 != number {
                let y = usize::try_from(top + number).ok().filter(|&y| y < image.height());
                let source = y.map_or(&[][..], |y| image.row(y));
                resample(source, &self.columns, fill, &mut self.rows[slot].1);
                self.rows[slot].0 = number;
            }
        }
    }
}

/// A row at the taps, whose places rise, times 2048; pixels that `source` has not are `fill`.
fn resample(source: &[Rgb8], taps: &[Tap], fill: Rgb8, out: &mut [[i32; 3]]) {
    let (Some(leftmost), Some(rightmost)) = (taps.first(), taps.last()) else { return };
    if leftmost.first >= 0 && rightmost.second < source.len() as i64 {
        weigh(taps, |x| source[x as usize], out);
    } else {
        weigh(taps, |x| usize::try_from(x).ok().and_then(|x| source.get(x)).copied().unwrap_or(fill), out);
    }
}

#[inline(always)]
fn weigh(taps: &[Tap], pixel: impl Fn(i64) -> Rgb8, out: &mut [[i32; 3]]) {
    for (out, tap) in out.iter_mut().zip(taps) {
        let (a, b) = (pixel(tap.first), pixel(tap.second));
        for c in 0..3 {
            out[c] = i32::from(a[c]) * (ONE - tap.weight) + i32::from(b[c]) * tap.weight;
        }
    }
}

/// The row between two that are resampled horizontally.
#[multiversion(targets("x86_64+avx2", "aarch64+neon"))]
fn blend(upper: &[[i32; 3]], lower: &[[i32; 3]], weight: i32, out: &mut [[f32; 3]]) {
    let sums = upper.as_flattened().iter().zip(lower.as_flattened());
    for (out, (&upper, &lower)) in out.as_flattened_mut().iter_mut().zip(sums) {
        *out = between(upper, lower, weight) as f32;
    }
}

/// Between two sums in 1/2048, to the nearest whole number: in 16-bit steps, as the library does with which the networks
/// were trained, so that the same grey levels come out.
#[inline(always)]
const fn between(upper: i32, lower: i32, weight: i32) -> i32 {
    ((((upper >> 4) * (ONE - weight)) >> 16) + (((lower >> 4) * weight) >> 16) + 2) >> 2
}
