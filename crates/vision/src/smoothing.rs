//! Gaussian smoothing in fixed point.

use crate::window::PixelWindow;
use multiversion::multiversion;
use pursuit_imaging::{Image, ImageView, ImagingError, Result, Rgb8};

/// Weights of the 5-tap Gaussian with σ = 3 in 1/256: exp(−d²/18), normalised, rounded so that they sum to 256.
pub const GAUSSIAN_5_SIGMA_3: [u16; 5] = [46, 54, 56, 54, 46];

/// Taps on either side of the centre.
const REACH: usize = 2;

/// Three planes of a part of a colour image, smoothed; owns its scratch, so nothing is allocated from frame to frame.
#[derive(Debug, Clone)]
pub struct SmoothedColor {
    window: PixelWindow,
    planes: [Image<u8>; 3],
    /// One row of one channel, with `REACH` pixels more on either side.
    padded: Vec<u8>,
    /// Horizontally smoothed rows, 5 for each channel, in 1/256 of a code; row `y` in slot `y % 5`.
    rows: Vec<u16>,
}

impl Default for SmoothedColor {
    fn default() -> Self {
        Self::new()
    }
}

impl SmoothedColor {
    /// Scratch without content.
    pub fn new() -> Self {
        let empty = || Image::filled(1, 1, 0u8).unwrap_or_else(|_| unreachable!("one pixel is a valid size"));
        Self {
            window: PixelWindow { x: 0, y: 0, width: 1, height: 1 },
            planes: [empty(), empty(), empty()],
            padded: Vec::new(),
            rows: Vec::new(),
        }
    }

    /// Smooths the part `window` of `image` with the 5×5 Gaussian of σ = 3; pixels beyond the window count as they are,
    /// pixels beyond the image by reflection about the border pixel.
    ///
    /// # Errors
    /// When the window and the image have no pixel in common. A window that reaches over the image is cut.
    pub fn smooth(&mut self, image: ImageView<'_, Rgb8>, window: PixelWindow) -> Result<()> {
        let Some(window) = window.intersection(&PixelWindow::full(image.size())) else {
            return Err(ImagingError::Size { width: 0, height: 0 });
        };
        self.window = window;
        let width = window.width;
        for plane in &mut self.planes {
            plane.resize_for_overwrite(window.size(), 0)?;
        }
        self.padded.resize(width + 2 * REACH, 0);
        self.rows.resize(15 * width, 0);

        let first = window.y as isize - REACH as isize;
        for source in first..=(window.y + window.height - 1 + REACH) as isize {
            let slot = (source - first) as usize;
            self.smooth_row(image.row(reflected(source, image.height())), slot % 5);
            if slot >= 2 * REACH {
                let out = slot - 2 * REACH;
                for (plane, rows) in self.planes.iter_mut().zip(self.rows.chunks_exact(5 * width)) {
                    let row = |k: usize| &rows[(out + k) % 5 * width..][..width];
                    combine_rows([row(0), row(1), row(2), row(3), row(4)], plane.row_mut(out));
                }
            }
        }
        Ok(())
    }

    /// The part of the image that was smoothed last.
    pub const fn window(&self) -> PixelWindow {
        self.window
    }

    /// Red, green and blue of the window.
    pub fn planes(&self) -> [ImageView<'_, u8>; 3] {
        let [r, g, b] = &self.planes;
        [r.view(), g.view(), b.view()]
    }

    /// The smoothed colour at column `x`, row `y` of the window (border replication).
    pub fn pixel(&self, x: usize, y: usize) -> Rgb8 {
        self.planes().map(|plane| plane.clamped(x as isize, y as isize))
    }

    fn smooth_row(&mut self, row: &[Rgb8], slot: usize) {
        let width = self.window.width;
        for (channel, rows) in self.rows.chunks_exact_mut(5 * width).enumerate() {
            let inside = &row[self.window.x..self.window.x + width];
            take_channel(inside, channel, &mut self.padded[REACH..REACH + width]);
            for k in 1..=REACH {
                let at = |x: isize| row[reflected(x, row.len())][channel];
                self.padded[REACH - k] = at(self.window.x as isize - k as isize);
                self.padded[REACH + width - 1 + k] = at((self.window.x + width - 1 + k) as isize);
            }
            smooth_horizontally(&self.padded, &mut rows[slot * width..][..width]);
        }
    }
}

/// Index `i` folded back into `0..len` about the border pixels: −1 → 1, len → len − 2.
pub(crate) fn reflected(i: isize, len: usize) -> usize {
    let period = 2 * (len as isize - 1);
    if period == 0 {
        return 0;
    }
    let folded = i.rem_euclid(period);
    folded.min(period - folded) as usize
}

#[multiversion(targets("x86_64+avx2", "x86_64+sse4.1", "aarch64+neon"))]
fn take_channel(row: &[Rgb8], channel: usize, out: &mut [u8]) {
    for (out, pixel) in out.iter_mut().zip(row) {
        *out = pixel[channel];
    }
}

#[multiversion(targets("x86_64+avx2", "x86_64+sse4.1", "aarch64+neon"))]
fn smooth_horizontally(padded: &[u8], out: &mut [u16]) {
    let [w0, w1, w2, _, _] = GAUSSIAN_5_SIGMA_3;
    let n = out.len();
    let (a, b, c, d, e) = (&padded[..n], &padded[1..n + 1], &padded[2..n + 2], &padded[3..n + 3], &padded[4..n + 4]);
    for i in 0..n {
        // At most 255 · 256, so 16 bits suffice.
        out[i] =
            w0 * (u16::from(a[i]) + u16::from(e[i])) + w1 * (u16::from(b[i]) + u16::from(d[i])) + w2 * u16::from(c[i]);
    }
}

#[multiversion(targets("x86_64+avx2", "x86_64+sse4.1", "aarch64+neon"))]
fn combine_rows(rows: [&[u16]; 5], out: &mut [u8]) {
    let [w0, w1, w2, _, _] = GAUSSIAN_5_SIGMA_3.map(u32::from);
    let n = out.len();
    let [a, b, c, d, e] = rows.map(|r| &r[..n]);
    for i in 0..n {
        let sum = w0 * (u32::from(a[i]) + u32::from(e[i]))
            + w1 * (u32::from(b[i]) + u32::from(d[i]))
            + w2 * u32::from(c[i])
            + (1 << 15);
        out[i] = (sum >> 16) as u8;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use pursuit_testkit::Noise;

    include!("../tests/fixtures/gaussian.rs");

    fn fixture(rows: &[[u8; 13]; 9]) -> Image<u8> {
        Image::from_vec(rows.concat(), 13, 9).unwrap()
    }

    #[test]
    fn smoothing_is_that_of_opencv() {
        let (image, expected) = (fixture(&IMAGE), fixture(&SMOOTHED));
        let color = Image::from_fn(13, 9, |x, y| [image.row(y)[x], 0, 255]).unwrap();
        let mut smoothed = SmoothedColor::new();
        smoothed.smooth(color.view(), PixelWindow::full(color.size())).unwrap();
        for (x, y) in (0..9).flat_map(|y| (0..13).map(move |x| (x, y))) {
            assert_eq!(smoothed.pixel(x, y), [expected.row(y)[x], 0, 255], "{x} {y}");
        }
    }

    #[test]
    fn weights_are_the_gaussian_to_a_code() {
        let exact = [-2.0, -1.0, 0.0, 1.0, 2.0].map(|d: f64| (-d * d / 18.0).exp());
        let sum: f64 = exact.iter().sum();
        assert_eq!(GAUSSIAN_5_SIGMA_3.iter().sum::<u16>(), 256);
        for (w, e) in GAUSSIAN_5_SIGMA_3.iter().zip(exact) {
            assert!((f64::from(*w) - 256.0 * e / sum).abs() < 1.0);
        }
    }

    /// The slow, obvious reference: 25 weighted pixels.
    fn slow(image: &Image<Rgb8>, x: usize, y: usize) -> Rgb8 {
        let mut sum = [0u32; 3];
        for (j, &wy) in GAUSSIAN_5_SIGMA_3.iter().enumerate() {
            for (i, &wx) in GAUSSIAN_5_SIGMA_3.iter().enumerate() {
                let at_x = reflected(x as isize + i as isize - 2, image.width());
                let at_y = reflected(y as isize + j as isize - 2, image.height());
                for c in 0..3 {
                    sum[c] += u32::from(wx) * u32::from(wy) * u32::from(image.row(at_y)[at_x][c]);
                }
            }
        }
        sum.map(|s| ((s + (1 << 15)) >> 16) as u8)
    }

    proptest! {
        #[test]
        fn windows_of_the_colour_image_equal_the_reference(
            (w, h) in (1usize..40, 1usize..20), seed in any::<u32>(), (x, y) in (0usize..40, 0usize..20),
            (cw, ch) in (1usize..40, 1usize..20),
        ) {
            let mut noise = Noise::new(seed | 1);
            let image = Image::from_fn(w, h, |_, _| {
                let state = noise.draw();
                [(state >> 8) as u8, (state >> 16) as u8, (state >> 24) as u8]
            }).unwrap();
            let window = PixelWindow { x: x % w, y: y % h, width: cw, height: ch };
            let mut smoothed = SmoothedColor::new();
            smoothed.smooth(image.view(), window).unwrap();
            let got = smoothed.window();
            prop_assert_eq!((got.x, got.y, got.width), (window.x, window.y, cw.min(w - window.x)));
            for j in 0..got.height {
                for i in 0..got.width {
                    prop_assert_eq!(smoothed.pixel(i, j), slow(&image, got.x + i, got.y + j));
                }
            }
        }
    }
}
