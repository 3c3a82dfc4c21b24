//! Means of pixels, and which of them were ever seen.

use pursuit_geometry::Size;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Codes are kept in 256ths.
pub(super) const UNIT: i32 = 256;

/// A mean for every channel of every pixel, and whether it was ever seen.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Canvas {
    width: usize,
    height: usize,
    channels: usize,
    /// In 256ths of a code, pixel by pixel.
    mean: Vec<u16>,
    known: Vec<bool>,
}

impl Canvas {
    /// Of which nothing is known.
    pub fn new(size: Size, channels: usize) -> Self {
        let Size { width, height } = size;
        let n = width * height;
        Self { width, height, channels, mean: vec![0; n * channels], known: vec![false; n] }
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
        let rate = weight(rate);
        for (v, m) in value.iter().zip(&mut self.mean[at * self.channels..(at + 1) * self.channels]) {
            *m = if *known { mixed(*m, i32::from(*v), rate) } else { *v };
        }
        *known = true;
    }

    /// The value between pixels, by their weights; `None` where one of them is not known.
    pub fn between(&self, around: &[(usize, f64); 4]) -> Option<[u16; 3]> {
        let mut sum = [0.0; 3];
        for (number, weight) in around {
            sum.iter_mut().zip(self.known(*number)?).for_each(|(sum, v)| *sum += weight * f64::from(*v));
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
