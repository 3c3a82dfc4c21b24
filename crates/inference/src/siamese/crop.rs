use crate::resample::{Resampler, Window};
use pursuit_geometry::Point;
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
    /// (halves to even) that starts at ⌊c − (side + 1) / 2 + 1/2⌋.
    pub fn around(center: Point, side: f64) -> Self {
        let side = side.round_ties_even().clamp(1.0, Self::MAX_SIDE);
        let first = |c: f64| (c - (side + 1.0) / 2.0 + 0.5).floor().clamp(-1e12, 1e12) as i64;
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

    /// The middle.
    pub fn center(&self) -> Point {
        Point::new(self.left as f64 + self.width as f64 / 2.0, self.top as f64 + self.height as f64 / 2.0)
    }

    /// First column, first row, columns and rows.
    pub const fn ltwh(&self) -> (i64, i64, i64, i64) {
        (self.left, self.top, self.width, self.height)
    }
}

/// Cuts rectangles out of frames and resamples them, bilinearly, in whole grey levels as networks were trained on.
#[derive(Debug, Clone, Default)]
pub struct Cropper(Resampler);

impl Cropper {
    /// Resamples `region` of `image` to `samples` × `samples` and hands over row after row in three planes, in the order
    /// of the image's channels; what lies outside the image is `fill`.
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
        self.0.resample(image, window, (samples, samples), fill, row);
    }
}
