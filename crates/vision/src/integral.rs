//! Integral images: sums and variances of any window in constant time.

use crate::{Result, VisionError, window::PixelWindow};
use pursuit_geometry::Size;
use pursuit_imaging::ImageView;

/// Sums of the grey codes and of their squares above and left of every pixel (Viola and Jones 2001; Lewis 1995 for the
/// squares); made anew for every frame in the same memory.
#[derive(Debug, Clone, Default)]
pub struct IntegralImage {
    size: Size,
    /// (width + 1)·(height + 1) values, the first row and column 0; modulo 2³², which sums of windows survive.
    sums: Vec<u32>,
    squares: Vec<u64>,
}

impl IntegralImage {
    /// Windows of more pixels than this would overflow their sum.
    const MAX_WINDOW: usize = (u32::MAX / 255) as usize;

    /// An integral image of nothing; [`build`](Self::build) fills it.
    pub fn new() -> Self {
        Self::default()
    }

    /// Sums up `gray`.
    pub fn build(&mut self, gray: ImageView<'_, u8>) {
        self.size = gray.size();
        let stride = gray.width() + 1;
        self.sums.resize(stride * (gray.height() + 1), 0);
        self.squares.resize(stride * (gray.height() + 1), 0);
        self.sums[..stride].fill(0);
        self.squares[..stride].fill(0);
        for (y, row) in gray.rows().enumerate() {
            let (above, below) = self.sums[y * stride..].split_at_mut(stride);
            let (squares_above, squares_below) = self.squares[y * stride..].split_at_mut(stride);
            accumulate(row, above, &mut below[..stride], squares_above, &mut squares_below[..stride]);
        }
    }

    /// Size of the image.
    pub const fn size(&self) -> Size {
        self.size
    }

    /// The sums above row `y` and left of each column, width + 1 values, and those of the squares: for scans that go
    /// through many windows of a row. Differences are exact, modulo 2³² those of the sums. `None` beyond row `height`.
    pub fn row(&self, y: usize) -> Option<(&[u32], &[u64])> {
        let stride = self.size.width + 1;
        let range = y.checked_mul(stride)?..y.checked_add(1)?.checked_mul(stride)?;
        Some((self.sums.get(range.clone())?, self.squares.get(range)?))
    }

    /// All sums, row by row, and how many there are in a row: for means of many windows anywhere. As in [`row`](Self::row).
    pub fn sums(&self) -> (&[u32], usize) {
        (&self.sums, self.size.width + 1)
    }

    /// Sum of the grey codes in `window`.
    ///
    /// # Errors
    /// When the window is empty, reaches over the image, or has more than 16 million pixels.
    pub fn sum(&self, window: &PixelWindow) -> Result<u64> {
        let [a, b, c, d] = self.corners(window)?;
        let at = |i: usize| self.sums[i];
        Ok(u64::from(at(d).wrapping_sub(at(b)).wrapping_sub(at(c)).wrapping_add(at(a))))
    }

    /// Sum of the squares of the grey codes in `window`.
    ///
    /// # Errors
    /// As [`sum`](Self::sum).
    pub fn square_sum(&self, window: &PixelWindow) -> Result<u64> {
        let [a, b, c, d] = self.corners(window)?;
        let at = |i: usize| self.squares[i];
        Ok(at(d) + at(a) - at(b) - at(c))
    }

    /// Mean (grey codes) and variance (grey codes squared, divided by the number of pixels) of `window`.
    ///
    /// # Errors
    /// As [`sum`](Self::sum).
    pub fn mean_and_variance(&self, window: &PixelWindow) -> Result<(f64, f64)> {
        let corners = self.corners(window)?;
        Ok(self.moments(corners, (window.width * window.height) as u64))
    }

    /// As [`mean_and_variance`](Self::mean_and_variance), `None` for a window that is not inside: for scans of many
    /// windows.
    #[inline]
    pub fn variance(&self, window: &PixelWindow) -> Option<f64> {
        self.corners(window).ok().map(|corners| self.moments(corners, (window.width * window.height) as u64).1)
    }

    #[inline]
    fn moments(&self, [a, b, c, d]: [usize; 4], n: u64) -> (f64, f64) {
        let sum = self.sums[d].wrapping_sub(self.sums[b]).wrapping_sub(self.sums[c]).wrapping_add(self.sums[a]);
        let squares = self.squares[d] + self.squares[a] - self.squares[b] - self.squares[c];
        // n·Σv² − (Σv)² exactly, in whole numbers: a window of one value has variance 0.
        let spread = u128::from(n) * u128::from(squares) - u128::from(sum) * u128::from(sum);
        (f64::from(sum) / n as f64, spread as f64 / (n as f64 * n as f64))
    }

    /// Indices of the corners: above left, above right, below left, below right.
    #[inline]
    fn corners(&self, window: &PixelWindow) -> Result<[usize; 4]> {
        let &PixelWindow { x, y, width, height } = window;
        let fits = |from: usize, length: usize, all: usize| length > 0 && from <= all && length <= all - from;
        if !fits(x, width, self.size.width) || !fits(y, height, self.size.height) || width * height > Self::MAX_WINDOW {
            return Err(VisionError::SizeMismatch {
                what: "a window of the integral image",
                width: x.saturating_add(width),
                height: y.saturating_add(height),
                expected_width: self.size.width,
                expected_height: self.size.height,
            });
        }
        let stride = self.size.width + 1;
        let (above, below) = (y * stride, (y + height) * stride);
        Ok([above + x, above + x + width, below + x, below + x + width])
    }
}

fn accumulate(row: &[u8], above: &[u32], below: &mut [u32], squares_above: &[u64], squares_below: &mut [u64]) {
    let n = row.len();
    let (mut sum, mut squares) = (0u32, 0u64);
    let (above, squares_above) = (&above[1..=n], &squares_above[1..=n]);
    (below[0], squares_below[0]) = (0, 0);
    let (below, squares_below) = (&mut below[1..=n], &mut squares_below[1..=n]);
    for i in 0..n {
        let v = u32::from(row[i]);
        // A row has at most 32768 pixels, so its own sums fit.
        sum += v;
        squares += u64::from(v * v);
        below[i] = above[i].wrapping_add(sum);
        squares_below[i] = squares_above[i] + squares;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use pursuit_imaging::Image;
    use pursuit_testkit::Noise;

    proptest! {
        #[test]
        fn sums_and_variances_equal_the_twin(
            (w, h) in (1usize..40, 1usize..30), seed in any::<u32>(), (x, y) in (0usize..40, 0usize..30),
            (ww, wh) in (1usize..40, 1usize..30),
        ) {
            let mut noise = Noise::new(seed | 1);
            let image = Image::from_fn(w, h, |_, _| noise.byte()).unwrap();
            let mut integral = IntegralImage::new();
            integral.build(Image::filled(50, 3, 9).unwrap().view());
            integral.build(image.view());
            let window = PixelWindow { x, y, width: ww, height: wh };
            match image.view().crop(x, y, ww, wh) {
                None => {
                    prop_assert!(integral.sum(&window).is_err() && integral.square_sum(&window).is_err());
                    prop_assert!(integral.mean_and_variance(&window).is_err() && integral.variance(&window).is_none());
                }
                Some(crop) => {
                    let values: Vec<u64> = crop.rows().flatten().map(|&v| u64::from(v)).collect();
                    let n = values.len() as f64;
                    let mean = values.iter().sum::<u64>() as f64 / n;
                    let variance = values.iter().map(|&v| (v as f64 - mean).powi(2)).sum::<f64>() / n;
                    prop_assert_eq!(integral.sum(&window).unwrap(), values.iter().sum::<u64>());
                    prop_assert_eq!(integral.square_sum(&window).unwrap(), values.iter().map(|v| v * v).sum::<u64>());
                    let got = integral.mean_and_variance(&window).unwrap();
                    prop_assert!((got.0 - mean).abs() < 1e-9 && (got.1 - variance).abs() < 1e-6);
                    prop_assert_eq!(integral.variance(&window), Some(got.1));
                }
            }
        }
    }

    /// The sums of a large white image pass 2³²; its windows do not notice.
    #[test]
    fn large_images_wrap_around_unnoticed() {
        let image = Image::filled(5000, 4000, 255u8).unwrap();
        let mut integral = IntegralImage::new();
        integral.build(image.view());
        let window = PixelWindow { x: 4000, y: 3500, width: 900, height: 400 };
        assert_eq!(integral.sum(&window).unwrap(), 255 * 360_000);
        assert_eq!(integral.mean_and_variance(&window).unwrap(), (255.0, 0.0));
        assert!(integral.sum(&PixelWindow::full(image.size())).is_err());
        assert!(integral.sum(&PixelWindow { x: usize::MAX, y: 0, width: 2, height: 1 }).is_err());
        assert_eq!(integral.size(), image.size());
        let (sums, squares) = integral.row(2).unwrap();
        assert_eq!((sums.len(), sums[3], squares[3]), (5001, 6 * 255, 6 * 255 * 255));
        assert!(integral.row(4000).is_some() && integral.row(4001).is_none() && integral.row(usize::MAX).is_none());
    }
}
