//! Means of pixels, and which of them were ever seen; values between pixels.

use super::row;
use pursuit_geometry::{Point, Size};
use pursuit_imaging::Frame;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Codes are kept in 256ths.
pub(super) const UNIT: i32 = 256;
/// Frames in which a pixel is to be seen alike before a steady canvas knows it, and up to how many codes of difference are alike.
const STEADY: u8 = 8;
const ALIKE: u16 = 16;
/// A place nearer than this to the middle of a pixel, in pixels, is that pixel's.
const EXACT: f64 = 0.02;

/// A mean for every channel of every pixel, and whether it was ever seen.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Canvas {
    width: usize,
    height: usize,
    channels: usize,
    /// In 256ths of a code, pixel by pixel.
    mean: Vec<u16>,
    known: Vec<bool>,
    /// In how many frames one after the other a pixel that is not known yet was seen alike; empty where once is enough.
    #[serde(skip)]
    alike: Vec<u8>,
}

impl Canvas {
    /// Of which nothing is known.
    pub fn new(size: Size, channels: usize) -> Self {
        let Size { width, height } = size;
        let n = width * height;
        Self { width, height, channels, mean: vec![0; n * channels], known: vec![false; n], alike: Vec::new() }
    }

    /// The same, of which a pixel is known only once it was seen alike in [`STEADY`] frames: what passes by is no background.
    pub fn steady(self) -> Self {
        Self { alike: vec![0; self.known.len()], ..self }
    }

    /// Whether that is so.
    pub const fn is_steady(&self) -> bool {
        !self.alike.is_empty()
    }

    /// Whether it can be one of this size.
    pub fn is_sound(&self, size: Size) -> bool {
        let pixels = self.width.checked_mul(self.height);
        self.size() == size
            && matches!(self.channels, 1 | 3)
            && pixels == Some(self.known.len())
            && pixels.and_then(|n| n.checked_mul(self.channels)) == Some(self.mean.len())
    }

    pub const fn size(&self) -> Size {
        Size::new(self.width, self.height)
    }

    pub const fn channels(&self) -> usize {
        self.channels
    }

    /// The mean of a pixel by its number, row by row, in 256ths of a code; `None` where nothing was seen yet.
    pub fn known(&self, at: usize) -> Option<&[u16]> {
        if *self.known.get(at)? { self.mean.get(at * self.channels..(at + 1) * self.channels) } else { None }
    }

    /// Takes these values, codes, of these pixels of a row with weight `rate`; what was never seen is taken as it is.
    pub fn learn_row(&mut self, values: &[u8], y: usize, part: Range<usize>, rate: f64) {
        let values = values.get(part.start * self.channels..part.end * self.channels).unwrap_or_default();
        let (from, to) = (y * self.width + part.start, y * self.width + part.end);
        let mean = &mut self.mean[from * self.channels..to * self.channels];
        let rate = weight(rate);
        let pixels = values.chunks_exact(self.channels).zip(mean.chunks_exact_mut(self.channels));
        for ((pixel, mean), known) in pixels.zip(&mut self.known[from..to]) {
            for (v, m) in pixel.iter().zip(mean) {
                *m = if *known { mixed(*m, i32::from(*v) * UNIT, rate) } else { (i32::from(*v) * UNIT) as u16 };
            }
            *known = true;
        }
    }

    /// Takes the value of one pixel, in 256ths of a code, with weight `rate`.
    pub fn learn(&mut self, at: usize, value: &[u16], rate: f64) {
        let Some(known) = self.known.get_mut(at) else { return };
        if let (false, Some(alike)) = (*known, self.alike.get_mut(at)) {
            let mean = &mut self.mean[at * self.channels..(at + 1) * self.channels];
            let is_alike = value.iter().zip(&*mean).all(|(v, m)| v.abs_diff(*m) <= ALIKE * UNIT as u16);
            *alike = if is_alike { alike.saturating_add(1) } else { 1 };
            let share = i32::from(*alike);
            value
                .iter()
                .zip(mean)
                .for_each(|(v, m)| *m = (i32::from(*m) + (i32::from(*v) - i32::from(*m)) / share) as u16);
            *known = *alike >= STEADY;
            return;
        }
        let rate = weight(rate);
        for (v, m) in value.iter().zip(&mut self.mean[at * self.channels..(at + 1) * self.channels]) {
            *m = if *known { mixed(*m, i32::from(*v), rate) } else { *v };
        }
        *known = true;
    }

    /// The value at a point between pixels; `None` where one of them is not known.
    pub fn between(&self, at: Point) -> Option<[u16; 3]> {
        let mut sum = [0.0; 3];
        for (number, weight) in around(self.size(), at)? {
            sum.iter_mut().zip(self.known(number)?).for_each(|(sum, v)| *sum += weight * f64::from(*v));
        }
        Some(sum.map(|v| v.round() as u16))
    }
}

/// In 256ths, at least one.
fn weight(rate: f64) -> i32 {
    (rate.clamp(0.0, 1.0) * f64::from(UNIT)).round().max(1.0) as i32
}

/// The product is at most 255 · 256², the result between old and new.
fn mixed(old: u16, value: i32, rate: i32) -> u16 {
    let old = i32::from(old);
    (old + ((value - old) * rate) / UNIT) as u16
}

/// The numbers of the four pixels about a point, and their weights between them (bilinear); `None` beyond the outer ones.
pub(super) fn around(size: Size, at: Point) -> Option<[(usize, f64); 4]> {
    let axis = |at: f64, length: usize| {
        let (whole, part) = ((at - 0.5).floor(), (at - 0.5).rem_euclid(1.0));
        let (whole, part) = match part {
            part if part < EXACT => (whole, 0.0),
            part if part > 1.0 - EXACT => (whole + 1.0, 0.0),
            part => (whole, part),
        };
        let next = if part > 0.0 { whole + 1.0 } else { whole };
        (whole >= 0.0 && next < length as f64).then_some((whole as usize, next as usize, part))
    };
    let ((left, right, x), (top, bottom, y)) = (axis(at.x, size.width)?, axis(at.y, size.height)?);
    let number = |x: usize, y: usize| y * size.width + x;
    Some([
        (number(left, top), (1.0 - x) * (1.0 - y)),
        (number(right, top), x * (1.0 - y)),
        (number(left, bottom), (1.0 - x) * y),
        (number(right, bottom), x * y),
    ])
}

/// The value of a frame between its pixels, in 256ths of a code; false outside of the picture.
pub(super) fn sample(frame: &Frame, at: Point, value: &mut [u16]) -> bool {
    let (size, channels) = (frame.size(), value.len());
    let Some([(first, a), (second, b), (third, c), (fourth, d)]) = around(size, at) else { return false };
    let upper = row(frame, first / size.width, channels);
    let lower = row(frame, third / size.width, channels);
    let (left, right) = (first % size.width * channels, second % size.width * channels);
    debug_assert_eq!((third % size.width, fourth % size.width), (first % size.width, second % size.width));
    for (k, value) in value.iter_mut().enumerate() {
        let of = |row: &[u8], x: usize| f64::from(row[x + k]);
        let mean = a * of(upper, left) + b * of(upper, right) + c * of(lower, left) + d * of(lower, right);
        *value = (mean * f64::from(UNIT)).round() as u16;
    }
    true
}

/// The mean of the channels, in codes.
pub(super) fn brightness(value: &[u16]) -> f64 {
    value.iter().map(|v| f64::from(*v)).sum::<f64>() / (value.len().max(1) as f64 * f64::from(UNIT))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_steady_canvas_knows_what_was_seen_alike_for_a_while() {
        let size = Size::new(2, 1);
        let code = |v: u16| [v * UNIT as u16];
        let mut canvas = Canvas::new(size, 1).steady();
        for k in 0..u16::from(STEADY) {
            assert_eq!(canvas.known(0), None, "{k}");
            canvas.learn(0, &code(100 + k % 3), 0.1);
            canvas.learn(1, &code(if k == 4 { 200 } else { 100 }), 0.1);
        }
        let mean = f64::from(canvas.known(0).unwrap()[0]) / f64::from(UNIT);
        assert!((mean - 101.0).abs() < 0.5, "{mean}");
        assert_eq!(canvas.known(1), None, "something passed by");
        // What is known is learnt as ever.
        canvas.learn(0, &code(200), 1.0);
        assert_eq!(canvas.known(0), Some(&code(200)[..]));
    }

    #[test]
    fn places_between_pixels_are_weighed() {
        let size = Size::new(4, 3);
        assert_eq!(
            around(size, Point::new(1.5, 0.5)).unwrap().map(|(n, w)| (n, w)),
            [(1, 1.0), (1, 0.0), (1, 0.0), (1, 0.0)]
        );
        let quarter = around(size, Point::new(1.75, 1.0)).unwrap();
        assert_eq!(quarter.map(|(n, _)| n), [1, 2, 5, 6]);
        assert!(quarter.iter().zip([0.375, 0.125, 0.375, 0.125]).all(|((_, w), wanted)| (w - wanted).abs() < 1e-12));
        for outside in [(0.2, 1.0), (3.8, 1.0), (1.0, 2.7), (f64::NAN, 1.0)] {
            assert!(around(size, Point::new(outside.0, outside.1)).is_none(), "{outside:?}");
        }
    }
}
