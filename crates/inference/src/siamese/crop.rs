use super::Ties;
use crate::resample::{Places, Resampler, Window};
use pursuit_geometry::{Point, Size};
use pursuit_imaging::{ImageView, Rgb8};

/// A rectangle of whole pixels of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Region {
    left: i64,
    top: i64,
    width: i64,
    height: i64,
}

impl Region {
    /// The largest side that is cut, in pixels: more than any frame's.
    const MAX_SIDE: f64 = 1e6;

    /// The square of about `side` pixels around `center`, as SiamFC and its successors cut it: a whole number of pixels
    /// (halves to even) that starts at c − (side + 1) / 2, rounded, with `ties` for halves.
    pub fn around(center: Point, side: f64, ties: Ties) -> Self {
        let side = side.round_ties_even().clamp(1.0, Self::MAX_SIDE);
        let rounded = |v: f64| match ties {
            Ties::Up => (v + 0.5).floor(),
            Ties::Even => v.round_ties_even(),
            Ties::Away => v.round(),
        };
        let first = |c: f64| rounded(c - (side + 1.0) / 2.0).clamp(-1e12, 1e12) as i64;
        Self { left: first(center.x), top: first(center.y), width: side as i64, height: side as i64 }
    }

    /// The rectangle of about `width` × `height` pixels around `center`, as FEAR cuts it: all four numbers rounded down (FEAR cuts
    /// them off towards zero, by which windows over the left and upper border lie a pixel off).
    pub fn stretched(center: Point, (width, height): (f64, f64)) -> Self {
        let whole = |v: f64| v.floor().clamp(-1e12, 1e12) as i64;
        let side = |v: f64| (v.clamp(1.0, Self::MAX_SIDE)) as i64;
        Self {
            left: whole(center.x - width / 2.0),
            top: whole(center.y - height / 2.0),
            width: side(width),
            height: side(height),
        }
    }

    /// The square of `side` pixels around `center` as STARK and its successors cut it: a whole number of pixels, rounded up, whose
    /// corner is rounded (halves to even).
    pub fn rounded(center: Point, side: f64) -> Self {
        let side = side.ceil().clamp(1.0, Self::MAX_SIDE);
        let first = |c: f64| (c - side / 2.0).round_ties_even().clamp(-1e12, 1e12) as i64;
        Self { left: first(center.x), top: first(center.y), width: side as i64, height: side as i64 }
    }

    /// The square of about `side` pixels around `center` in a frame of `size` as MMTracking cuts it (`siamrpn.py`, `get_cropped_img`): from
    /// c − side / 2 to c + side / 2, both cut off towards zero and both taken in. What it puts beside the frame ends a pixel earlier,
    /// so that a window which reaches the right or the lower border has a column or a row less.
    pub fn inclusive(center: Point, side: f64, size: Size) -> Self {
        let side = side.round_ties_even().clamp(1.0, Self::MAX_SIDE);
        let ends = |c: f64, most: usize| {
            let [first, last] = [c - side / 2.0, c + side / 2.0].map(|v| v.clamp(-1e12, 1e12) as i64);
            let last = if last < most as i64 { last } else { last - 1 };
            (first, (last - first + 1).max(1))
        };
        let ((left, width), (top, height)) = (ends(center.x, size.width), ends(center.y, size.height));
        Self { left, top, width, height }
    }

    /// The middle.
    pub fn center(&self) -> Point {
        Point::new(self.left as f64 + self.width as f64 / 2.0, self.top as f64 + self.height as f64 / 2.0)
    }

    /// First column, first row, columns and rows.
    pub const fn ltwh(&self) -> (i64, i64, i64, i64) {
        (self.left, self.top, self.width, self.height)
    }
}

/// Cuts rectangles out of frames and resamples them, bilinearly.
#[derive(Debug, Clone, Default)]
pub struct Cropper {
    resampler: Resampler,
    /// A row without rounding, and of each of its samples the pixels it lies between, with the weight of the second.
    row: [Vec<f32>; 3],
    taps: Vec<Tap>,
}

/// Two neighbours, and the weight of the second.
type Tap = (i64, i64, f32);

impl Cropper {
    /// Whose places of samples are in double precision, if not in single as OpenCV's.
    pub fn new(double_precision: bool) -> Self {
        let places = if double_precision { Places::Double } else { Places::Single };
        Self { resampler: Resampler::new(places), ..Self::default() }
    }

    /// Resamples `region` of `image` to `samples` × `samples` in whole grey levels, as networks were trained on, and hands over row after
    /// row in three planes, in the order of the image's channels; what lies outside the image is `fill`.
    pub fn crop(
        &mut self,
        image: ImageView<'_, Rgb8>,
        region: Region,
        samples: usize,
        fill: Rgb8,
        row: impl FnMut(usize, [&mut [f32]; 3]),
    ) {
        let Region { left, top, width, height } = region;
        let window = Window { left, top, width, height };
        self.resampler.resample(image, window, (samples, samples), fill, row);
    }

    /// The same in fractions of grey levels: PyTorch's `interpolate`.
    pub fn interpolate(
        &mut self,
        image: ImageView<'_, Rgb8>,
        region: Region,
        samples: usize,
        fill: Rgb8,
        mut row: impl FnMut(usize, [&mut [f32]; 3]),
    ) {
        let tap = |i: usize, side: i64| {
            let place = ((i as f32 + 0.5) * side as f32 / samples as f32 - 0.5).max(0.0);
            let first = (place as i64).min(side - 1);
            (first, (first + 1).min(side - 1), place - first as f32)
        };
        let inside = |v: i64, most: usize| usize::try_from(v).ok().filter(|&v| v < most);
        self.taps.clear();
        self.taps.extend((0..samples).map(|i| tap(i, region.width)));
        self.row.iter_mut().for_each(|plane| plane.resize(samples, 0.0));
        for y in 0..samples {
            let (upper, lower, share) = tap(y, region.height);
            let lines = [upper, lower].map(|v| inside(region.top + v, image.height()).map(|v| image.row(v)));
            let level = |line: Option<&[Rgb8]>, x: i64, c: usize| {
                let x = inside(region.left + x, image.width());
                f32::from(line.zip(x).map_or(fill, |(line, x)| line[x])[c])
            };
            for (c, plane) in self.row.iter_mut().enumerate() {
                for (out, &(first, second, weight)) in plane.iter_mut().zip(&self.taps) {
                    let [upper, lower] =
                        lines.map(|l| level(l, first, c) * (1.0 - weight) + level(l, second, c) * weight);
                    *out = upper * (1.0 - share) + lower * share;
                }
            }
            row(y, self.row.each_mut().map(Vec::as_mut_slice));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_imaging::Image;

    #[test]
    fn a_window_midway_between_two_pixels_begins_where_its_project_rounds() {
        // 1.5 and 2.5; −0.5 and −1.5.
        for (ties, far, near) in
            [(Ties::Up, (2, 3), (0, -1)), (Ties::Even, (2, 2), (0, -2)), (Ties::Away, (2, 3), (-1, -2))]
        {
            let of = |x: f64, y: f64| {
                let (left, top, ..) = Region::around(Point::new(x, y), 4.0, ties).ltwh();
                (left, top)
            };
            assert_eq!((of(4.0, 5.0), of(2.0, 1.0)), (far, near), "{ties:?}");
            // 1.6 and −0.6.
            assert_eq!(of(4.1, 1.9), (2, -1), "{ties:?}");
        }
    }

    #[test]
    fn an_inclusive_window_has_its_last_pixels_but_at_the_far_borders() {
        let of = |x: f64, y: f64, side: f64| Region::inclusive(Point::new(x, y), side, Size::new(100, 80)).ltwh();
        // 30.3 to 50.3 and 20.8 to 40.8.
        assert_eq!(of(40.3, 30.8, 20.0), (30, 20, 21, 21));
        // −3.7 is cut off to −3.
        assert_eq!(of(6.3, 30.0, 20.0), (-3, 20, 20, 21));
        // 105 lies beyond column 99, 80 is no row.
        assert_eq!(of(95.0, 70.0, 20.0), (85, 60, 20, 20));
        assert_eq!(of(40.0, 40.0, 0.0), (39, 39, 2, 2));
    }

    #[test]
    fn what_is_not_rounded_is_what_pytorch_gives() {
        let image =
            Image::from_fn(4, 3, |x, y| [(10 * x + 50 * y) as u8, (x * x * 9) as u8, (200 - 60 * y) as u8]).unwrap();
        let region = Region { left: 1, top: 1, width: 4, height: 3 };
        let mut rows = Vec::new();
        Cropper::default().interpolate(image.view(), region, 5, [7, 8, 9], |_, planes| {
            rows.push(planes.map(|plane| plane.to_vec()));
        });
        // torch.nn.functional.interpolate of 60 70 80 7, 110 120 130 7, 7 7 7 7 and its likes to 5 × 5, not aligned at corners.
        for ((y, c), want) in [
            ((0, 0), [60.0, 67.0, 75.0, 58.1, 7.0]),
            ((1, 0), [80.0, 87.0, 95.0, 72.1, 7.0]),
            ((4, 0), [7.0; 5]),
            ((2, 1), [9.0, 27.9, 58.5, 59.1, 8.0]),
            ((1, 2), [116.0, 116.0, 116.0, 83.9, 9.0]),
        ] {
            for (got, want) in rows[y][c].iter().zip(want) {
                assert!((got - want).abs() < 1e-4_f32, "row {y} of plane {c}: {:?}", rows[y][c]);
            }
        }
    }
}
