use pursuit_geometry::Point;
use pursuit_imaging::{ImageView, Rgb8};

/// Bits of the fraction in which a pixel's weight is kept.
const BITS: u32 = 11;
const ONE: i32 = 1 << BITS;

/// A square of whole pixels of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Region {
    left: i64,
    top: i64,
    side: i64,
}

impl Region {
    /// The largest side that is cut, in pixels: more than any frame's.
    const MAX_SIDE: f64 = 1e6;

    /// The square of about `side` pixels around `center`, as SiamFC and its successors cut it: a whole number of pixels
    /// (halves to even) that starts at ⌊c − (side + 1) / 2 + 1/2⌋.
    pub fn around(center: Point, side: f64) -> Self {
        let side = side.round_ties_even().clamp(1.0, Self::MAX_SIDE);
        let first = |c: f64| (c - (side + 1.0) / 2.0 + 0.5).floor().clamp(-1e12, 1e12) as i64;
        Self { left: first(center.x), top: first(center.y), side: side as i64 }
    }

    /// First column, first row, and pixels of a side.
    pub const fn left_top_side(&self) -> (i64, i64, i64) {
        (self.left, self.top, self.side)
    }
}

/// Cuts squares out of frames and resamples them, bilinearly, in whole grey levels as networks were trained on.
#[derive(Debug, Clone, Default)]
pub struct Cropper {
    columns: Vec<Tap>,
    /// The two rows of the frame between which a row lies, resampled horizontally, with their numbers in the region.
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

impl Cropper {
    /// Resamples `region` of `image` to `samples` × `samples` and hands over row after row; what lies outside the image
    /// is `fill`.
    pub fn crop(
        &mut self,
        image: ImageView<'_, Rgb8>,
        region: Region,
        samples: usize,
        fill: Rgb8,
        mut row: impl FnMut(usize, &mut [[f32; 3]]),
    ) {
        self.columns.clear();
        self.columns.extend((0..samples).map(|i| Tap::across(i, samples, region.side)));
        self.columns.iter_mut().for_each(|tap| {
            tap.first += region.left;
            tap.second += region.left;
        });
        self.rows.iter_mut().for_each(|(number, row)| {
            *number = -1;
            row.resize(samples, [0; 3]);
        });
        self.pixels.resize(samples, [0.0; 3]);
        for y in 0..samples {
            let tap = Tap::down(y, samples, region.side);
            self.make_row(image, region, tap.first, tap.second, fill);
            let (upper, lower) = (&self.rows[0].1, &self.rows[1].1);
            for ((pixel, upper), lower) in self.pixels.iter_mut().zip(upper).zip(lower) {
                for c in 0..3 {
                    pixel[c] = between(upper[c], lower[c], tap.weight) as f32;
                }
            }
            row(y, &mut self.pixels);
        }
    }

    /// Makes rows `first` and `second` of the region the two rows that are kept.
    fn make_row(&mut self, image: ImageView<'_, Rgb8>, region: Region, first: i64, second: i64, fill: Rgb8) {
        if self.rows[1].0 == first {
            self.rows.swap(0, 1);
        }
        for (slot, number) in [(0, first), (1, second)] {
            if self.rows[slot].0 != number {
                let y = usize::try_from(region.top + number).ok().filter(|&y| y < image.height());
                let source = y.map_or(&[][..], |y| image.row(y));
                resample(source, &self.columns, fill, &mut self.rows[slot].1);
                self.rows[slot].0 = number;
            }
        }
    }
}

/// A row at the taps, times 2048; pixels that `source` has not are `fill`.
fn resample(source: &[Rgb8], taps: &[Tap], fill: Rgb8, out: &mut [[i32; 3]]) {
    let pixel = |x: i64| usize::try_from(x).ok().and_then(|x| source.get(x)).copied().unwrap_or(fill);
    for (out, tap) in out.iter_mut().zip(taps) {
        let (a, b) = (pixel(tap.first), pixel(tap.second));
        for c in 0..3 {
            out[c] = i32::from(a[c]) * (ONE - tap.weight) + i32::from(b[c]) * tap.weight;
        }
    }
}

/// Between two sums in 1/2048, to the nearest whole number: in 16-bit steps, as the library does with which the networks
/// were trained, so that the same grey levels come out.
#[inline(always)]
const fn between(upper: i32, lower: i32, weight: i32) -> i32 {
    ((((upper >> 4) * (ONE - weight)) >> 16) + (((lower >> 4) * weight) >> 16) + 2) >> 2
}
