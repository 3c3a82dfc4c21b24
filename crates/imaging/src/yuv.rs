use crate::{Image, ImageView, ImagingError, Result, Rgb8, SharedImage};
use multiversion::multiversion;
use pursuit_geometry::Size;

/// Which matrix relates luma and chroma to red, green and blue.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ColorMatrix {
    /// ITU-R BT.601, standard definition and JPEG.
    #[default]
    Bt601,
    /// ITU-R BT.709, high definition.
    Bt709,
}

/// How luma and chroma codes map to intensities.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ColorRange {
    /// Luma 16–235, chroma 16–240: what video normally carries.
    #[default]
    Limited,
    /// All 256 codes, as JPEG does.
    Full,
}

/// A planar 4:2:0 colour image as decoders deliver it: full-size luma, chroma halved (rounding up) both ways. Clones
/// share the planes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Yuv420 {
    y: SharedImage<u8>,
    u: SharedImage<u8>,
    v: SharedImage<u8>,
    matrix: ColorMatrix,
    range: ColorRange,
}

impl Yuv420 {
    /// From three planes; `u` and `v` must be `ceil(width / 2) × ceil(height / 2)`.
    ///
    /// # Errors
    /// [`ImagingError::BufferLength`] when a chroma plane has the wrong size.
    pub fn new<I: Into<SharedImage<u8>>>(y: I, u: I, v: I, matrix: ColorMatrix, range: ColorRange) -> Result<Self> {
        let (y, u, v) = (y.into(), u.into(), v.into());
        let half = Size::new(y.width().div_ceil(2), y.height().div_ceil(2));
        for plane in [&u, &v] {
            if plane.size() != half {
                return Err(ImagingError::BufferLength {
                    width: half.width,
                    height: half.height,
                    stride: half.width,
                    needed: half.area(),
                    actual: plane.size().area(),
                });
            }
        }
        Ok(Self { y, u, v, matrix, range })
    }

    /// Width and height of the picture.
    pub const fn size(&self) -> Size {
        self.y.size()
    }

    /// The luma codes as stored.
    pub fn luma(&self) -> ImageView<'_, u8> {
        self.y.view()
    }

    /// The two chroma planes as stored: blue-difference, red-difference.
    pub fn chroma(&self) -> (ImageView<'_, u8>, ImageView<'_, u8>) {
        (self.u.view(), self.v.view())
    }

    /// How codes map to intensities.
    pub const fn range(&self) -> ColorRange {
        self.range
    }

    /// Which matrix relates the planes to red, green and blue.
    pub const fn matrix(&self) -> ColorMatrix {
        self.matrix
    }

    /// The part of `width` × `height` pixels whose top left pixel is `(x, y)`, sharing the planes; `None` unless it lies
    /// inside and `x` and `y` are even.
    #[must_use]
    pub fn crop(&self, x: usize, y: usize, width: usize, height: usize) -> Option<Self> {
        let y_plane = self.y.crop(x, y, width, height).filter(|_| x.is_multiple_of(2) && y.is_multiple_of(2))?;
        let half = |plane: &SharedImage<u8>| plane.crop(x / 2, y / 2, width.div_ceil(2), height.div_ceil(2));
        Some(Self { y: y_plane, u: half(&self.u)?, v: half(&self.v)?, ..*self })
    }

    /// Luma stretched to 0–255, or `None` when the stored plane already is (then borrow [`luma`](Self::luma)).
    pub(crate) fn expanded_luma(&self) -> Option<Image<u8>> {
        (self.range == ColorRange::Limited).then(|| {
            let mut gray = self.y.to_image();
            expand_limited(gray.as_mut_slice());
            gray
        })
    }

    /// The grey level, 0 to 255, of a luma code, or of a mean of such.
    pub(crate) fn level(&self, code: f64) -> f64 {
        match self.range {
            ColorRange::Limited => ((code - 16.0) * 255.0 / 219.0).clamp(0.0, 255.0),
            ColorRange::Full => code,
        }
    }

    /// The colours of a run of samples, chroma as many as luma.
    pub(crate) fn convert(&self, y: &[u8], u: &[u8], v: &[u8], out: &mut [Rgb8]) {
        samples_to_rgb(y, u, v, &Coefficients::new(self.matrix, self.range), out);
    }

    /// Converts to red, green, blue (chroma replicated, as fast decoders do).
    pub fn to_rgb(&self) -> Image<Rgb8> {
        let coefficients = Coefficients::new(self.matrix, self.range);
        let (width, height) = (self.y.width(), self.y.height());
        let (y, u, v) = (self.y.view(), self.u.view(), self.v.view());
        let mut data = vec![[0u8; 3]; width * height];
        for (row, out) in data.chunks_exact_mut(width).enumerate() {
            row_to_rgb(y.row(row), u.row(row / 2), v.row(row / 2), &coefficients, out);
        }
        // The length is width · height of an image that exists, so this cannot fail.
        Image::from_vec(data, width, height).unwrap_or_else(|_| unreachable!("size of an existing image"))
    }
}

/// Conversion in 16-bit fixed point with 6 fractional bits: enough for 8-bit results within 1 code of the exact matrix.
struct Coefficients {
    luma_offset: i32,
    luma_gain: i32,
    red_v: i32,
    green_u: i32,
    green_v: i32,
    blue_u: i32,
}

const FRACTION_BITS: u32 = 14;

impl Coefficients {
    fn new(matrix: ColorMatrix, range: ColorRange) -> Self {
        // Luma weights of red and blue: BT.601-7 table 3, BT.709-6 table 3.
        let (kr, kb) = match matrix {
            ColorMatrix::Bt601 => (0.299, 0.114),
            ColorMatrix::Bt709 => (0.2126, 0.0722),
        };
        let kg = 1.0 - kr - kb;
        let (luma_offset, luma_gain, chroma_gain) = match range {
            ColorRange::Limited => (16, 255.0 / 219.0, 255.0 / 224.0),
            ColorRange::Full => (0, 1.0, 1.0),
        };
        let fixed = |v: f64| (v * f64::from(1 << FRACTION_BITS)).round() as i32;
        Self {
            luma_offset,
            luma_gain: fixed(luma_gain),
            red_v: fixed(chroma_gain * 2.0 * (1.0 - kr)),
            green_u: fixed(chroma_gain * 2.0 * kb * (1.0 - kb) / kg),
            green_v: fixed(chroma_gain * 2.0 * kr * (1.0 - kr) / kg),
            blue_u: fixed(chroma_gain * 2.0 * (1.0 - kb)),
        }
    }
}

/// Pixels converted at once; even.
const RUN: usize = 64;

/// In steps that each run on vectors: what chroma adds, the three channels one by one, then all of them interleaved.
#[multiversion(targets("x86_64+avx2", "x86_64+sse4.1", "aarch64+neon"))]
fn row_to_rgb(y: &[u8], u: &[u8], v: &[u8], c: &Coefficients, out: &mut [Rgb8]) {
    let half = 1 << (FRACTION_BITS - 1);
    let clamp = |value: i32| (value >> FRACTION_BITS).clamp(0, 255) as u8;
    let (mut red_part, mut green_part, mut blue_part) =
        ([[0_i32; 2]; RUN / 2], [[0_i32; 2]; RUN / 2], [[0_i32; 2]; RUN / 2]);
    let (mut red, mut green, mut blue) = ([0_u8; RUN], [0_u8; RUN], [0_u8; RUN]);
    let runs = out.chunks_mut(RUN).zip(y.chunks(RUN)).zip(u.chunks(RUN / 2).zip(v.chunks(RUN / 2)));
    for ((out, luma), (u, v)) in runs {
        let parts = red_part.iter_mut().zip(&mut green_part).zip(&mut blue_part);
        for (((r, g), b), (&u, &v)) in parts.zip(u.iter().zip(v)) {
            let (u, v) = (i32::from(u) - 128, i32::from(v) - 128);
            *r = [c.red_v * v; 2];
            *g = [c.green_u * u + c.green_v * v; 2];
            *b = [c.blue_u * u; 2];
        }
        let parts = red_part.as_flattened().iter().zip(green_part.as_flattened()).zip(blue_part.as_flattened());
        let channels = red.iter_mut().zip(&mut green).zip(&mut blue);
        for ((((r, g), b), ((red_part, green_part), blue_part)), &luma) in channels.zip(parts).zip(luma) {
            let y = (i32::from(luma) - c.luma_offset) * c.luma_gain + half;
            *r = clamp(y + red_part);
            *g = clamp(y - green_part);
            *b = clamp(y + blue_part);
        }
        for (pixel, ((&r, &g), &b)) in out.iter_mut().zip(red.iter().zip(&green).zip(&blue)) {
            *pixel = [r, g, b];
        }
    }
}

#[multiversion(targets("x86_64+avx2", "x86_64+sse4.1", "aarch64+neon"))]
fn samples_to_rgb(y: &[u8], u: &[u8], v: &[u8], c: &Coefficients, out: &mut [Rgb8]) {
    let half = 1 << (FRACTION_BITS - 1);
    let clamp = |value: i32| (value >> FRACTION_BITS).clamp(0, 255) as u8;
    let (mut samples, mut channels) = ([[0_u8; RUN]; 3], [[0_u8; RUN]; 3]);
    let runs = out.chunks_mut(RUN).zip(y.chunks(RUN)).zip(u.chunks(RUN).zip(v.chunks(RUN)));
    for ((out, y), (u, v)) in runs {
        // Loops of known length run on vectors; the last run converts what was there before once more.
        samples.iter_mut().zip([y, u, v]).for_each(|(run, plane)| run[..plane.len()].copy_from_slice(plane));
        let ([y, u, v], [red, green, blue]) = (&samples, &mut channels);
        for i in 0..RUN {
            let luma = (i32::from(y[i]) - c.luma_offset) * c.luma_gain + half;
            let (u, v) = (i32::from(u[i]) - 128, i32::from(v[i]) - 128);
            red[i] = clamp(luma + c.red_v * v);
            green[i] = clamp(luma - c.green_u * u - c.green_v * v);
            blue[i] = clamp(luma + c.blue_u * u);
        }
        for (pixel, ((&r, &g), &b)) in out.iter_mut().zip(red.iter().zip(&*green).zip(&*blue)) {
            *pixel = [r, g, b];
        }
    }
}

#[multiversion(targets("x86_64+avx2", "x86_64+sse4.1", "aarch64+neon"))]
fn expand_limited(codes: &mut [u8]) {
    for code in codes {
        // (code - 16) · 255 / 219, rounded: 298 / 256 is 255 / 219 to 4 digits.
        let value = (i32::from(*code) - 16) * 298 + 128;
        *code = (value >> 8).clamp(0, 255) as u8;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The matrix in floating point: the slow, obvious reference.
    fn exact(y: u8, u: u8, v: u8, matrix: ColorMatrix, range: ColorRange) -> [f64; 3] {
        let (kr, kb) = if matrix == ColorMatrix::Bt601 { (0.299, 0.114) } else { (0.2126, 0.0722) };
        let (y, u, v) = match range {
            ColorRange::Full => (f64::from(y), f64::from(u) - 128.0, f64::from(v) - 128.0),
            ColorRange::Limited => (
                (f64::from(y) - 16.0) * 255.0 / 219.0,
                (f64::from(u) - 128.0) * 255.0 / 224.0,
                (f64::from(v) - 128.0) * 255.0 / 224.0,
            ),
        };
        let (r, b) = (y + 2.0 * (1.0 - kr) * v, y + 2.0 * (1.0 - kb) * u);
        let g = (y - kr * r - kb * b) / (1.0 - kr - kb);
        [r, g, b].map(|c| c.clamp(0.0, 255.0))
    }

    #[test]
    fn conversion_stays_within_one_code_of_the_exact_matrix() {
        for matrix in [ColorMatrix::Bt601, ColorMatrix::Bt709] {
            for range in [ColorRange::Limited, ColorRange::Full] {
                for code in 0..4096u32 {
                    let [y, u, v] =
                        [code.wrapping_mul(97), code.wrapping_mul(57), code.wrapping_mul(31)].map(|c| (c % 256) as u8);
                    let plane = |value| Image::filled(1, 1, value).unwrap();
                    let yuv = Yuv420::new(plane(y), plane(u), plane(v), matrix, range).unwrap();
                    let rgb = yuv.to_rgb().as_slice()[0];
                    for (got, want) in rgb.iter().zip(exact(y, u, v, matrix, range)) {
                        assert!((f64::from(*got) - want).abs() <= 1.0, "{y} {u} {v} {matrix:?} {range:?}: {rgb:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn every_pixel_of_a_wide_row_takes_its_own_luma_and_chroma() {
        for width in [1, 63, 64, 65, 130, 191] {
            let half = usize::div_ceil(width, 2);
            let y = Image::from_fn(width, 3, |x, row| (16 + (x * 37 + row * 11) % 220) as u8).unwrap();
            let u = Image::from_fn(half, 2, |x, row| (16 + (x * 29 + row * 7) % 225) as u8).unwrap();
            let v = Image::from_fn(half, 2, |x, row| (16 + (x * 53 + row * 5) % 225) as u8).unwrap();
            let (matrix, range) = (ColorMatrix::Bt709, ColorRange::Limited);
            let rgb = Yuv420::new(y.clone(), u.clone(), v.clone(), matrix, range).unwrap().to_rgb();
            for (row, x) in (0..3).flat_map(|row| (0..width).map(move |x| (row, x))) {
                let code = |plane: &Image<u8>, by: usize| plane.row(row / by)[x / by];
                let want = exact(code(&y, 1), code(&u, 2), code(&v, 2), matrix, range);
                let got = rgb.row(row)[x];
                assert!(got.iter().zip(want).all(|(g, w)| (f64::from(*g) - w).abs() <= 1.0), "{width}: {x} {row}");
            }
        }
    }

    #[test]
    fn odd_sizes_have_chroma_rounded_up() {
        let plane = |w, h| Image::filled(w, h, 128u8).unwrap();
        let yuv = Yuv420::new(plane(5, 3), plane(3, 2), plane(3, 2), ColorMatrix::Bt601, ColorRange::Full).unwrap();
        assert!(yuv.to_rgb().as_slice().iter().all(|p| *p == [128; 3]));
        assert!(Yuv420::new(plane(5, 3), plane(2, 1), plane(3, 2), ColorMatrix::Bt601, ColorRange::Full).is_err());
    }

    #[test]
    fn a_part_keeps_its_colours_and_starts_at_even_pixels() {
        let plane = |w, h, k: usize| Image::from_fn(w, h, |x, y| (40 + k * x + 9 * y) as u8).unwrap();
        let (matrix, range) = (ColorMatrix::Bt709, ColorRange::Limited);
        let yuv = Yuv420::new(plane(9, 7, 5), plane(5, 4, 11), plane(5, 4, 23), matrix, range).unwrap();
        let (whole, part) = (yuv.to_rgb(), yuv.crop(2, 4, 7, 3).unwrap());
        let (rgb, size) = (part.to_rgb(), part.size());
        assert_eq!((size.width, size.height, part.matrix(), part.range()), (7, 3, matrix, range));
        assert!((0..3).all(|row| rgb.row(row) == &whole.row(row + 4)[2..9]));
        for (x, y, w, h) in [(1, 0, 2, 2), (0, 1, 2, 2), (4, 0, 6, 2), (0, 6, 2, 2), (0, 0, 0, 2)] {
            assert_eq!(yuv.crop(x, y, w, h), None, "{x} {y} {w} {h}");
        }
    }

    #[test]
    fn limited_luma_is_stretched_to_the_full_range() {
        let y = Image::from_vec(vec![0, 16, 126, 235, 255, 16], 6, 1).unwrap();
        let c = Image::filled(3, 1, 128u8).unwrap();
        let yuv = Yuv420::new(y, c.clone(), c, ColorMatrix::Bt601, ColorRange::Limited).unwrap();
        assert_eq!(yuv.expanded_luma().unwrap().as_slice(), [0, 0, 128, 255, 255, 0]);
    }
}
