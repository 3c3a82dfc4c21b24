use pursuit_geometry::Size;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use rustfft::{Fft, FftNum, FftPlanner, num_complex::Complex};
use std::sync::Arc;

/// Plans of the discrete Fourier transform of real planes of one size, and back.
///
/// A plane has `width · height` values, row by row. Its spectrum has `(width/2 + 1) · height` bins, *column by column*: bin
/// `(u, v)`, `u` cycles across the width and `v` down the height, stands at `u·height + v`; the bins with `u > width/2` are
/// the conjugates of those at `(width − u, −v)`. The forward transform is `Σ f(x, y)·exp(−2πi(ux/width + vy/height))`,
/// without a factor; the inverse divides by `width · height`.
///
/// Cloning shares the plans. Any size works; even 5-smooth ones ([`good_size`](super::good_size)) are fast.
#[derive(Clone)]
pub struct RealFft2<T: FftNum = f32> {
    width: usize,
    height: usize,
    rows: Arc<dyn RealToComplex<T>>,
    rows_back: Arc<dyn ComplexToReal<T>>,
    columns: Arc<dyn Fft<T>>,
    columns_back: Arc<dyn Fft<T>>,
}

/// Working memory of a [`RealFft2`]; not state. One may serve plans of several sizes: it grows to the largest.
#[derive(Debug, Clone, Default)]
pub struct FftScratch<T = f32> {
    row: Vec<T>,
    turned: Vec<Complex<T>>,
    fft: Vec<Complex<T>>,
}

impl<T: FftNum> RealFft2<T> {
    /// Plans for planes of `width` × `height` values (at least 1 × 1).
    pub fn new(width: usize, height: usize) -> Self {
        let (width, height) = (width.max(1), height.max(1));
        let (mut real, mut complex) = (RealFftPlanner::new(), FftPlanner::new());
        Self {
            width,
            height,
            rows: real.plan_fft_forward(width),
            rows_back: real.plan_fft_inverse(width),
            columns: complex.plan_fft_forward(height),
            columns_back: complex.plan_fft_inverse(height),
        }
    }

    /// Size of the planes.
    pub const fn size(&self) -> Size {
        Size::new(self.width, self.height)
    }

    /// Columns of a spectrum: `width/2 + 1`.
    pub const fn columns(&self) -> usize {
        self.width / 2 + 1
    }

    /// Bins of a spectrum: `(width/2 + 1) · height`.
    pub const fn spectrum_len(&self) -> usize {
        self.columns() * self.height
    }

    /// How often the bins of column `u` count in a sum over the whole spectrum: twice, unless they are their own
    /// mirror image.
    pub const fn multiplicity(&self, u: usize) -> usize {
        if u == 0 || 2 * u == self.width { 1 } else { 2 }
    }

    /// The spectrum of `plane`.
    ///
    /// # Panics
    /// When a slice has the wrong length.
    pub fn forward(&self, plane: &[T], spectrum: &mut [Complex<T>], scratch: &mut FftScratch<T>) {
        assert_eq!(
            (plane.len(), spectrum.len()),
            (self.width * self.height, self.spectrum_len()),
            "lengths do not fit"
        );
        let columns = self.columns();
        let work = self.prepare(scratch);
        for (row, turned) in plane.chunks_exact(self.width).zip(work.pair.0.chunks_exact_mut(columns)) {
            work.row.copy_from_slice(row);
            // Lengths are the plan's own, so this cannot fail.
            let done = self.rows.process_with_scratch(work.row, turned, work.fft);
            debug_assert!(done.is_ok());
        }
        transpose(work.pair.0, spectrum, columns);
        self.columns.process_with_scratch(spectrum, work.fft);
    }

    /// The plane of `spectrum`; the imaginary parts of bins that must be real are ignored.
    ///
    /// # Panics
    /// When a slice has the wrong length.
    pub fn inverse(&self, spectrum: &[Complex<T>], plane: &mut [T], scratch: &mut FftScratch<T>) {
        self.inverse_partly(spectrum, plane, self.height, scratch);
    }

    /// As [`inverse`](Self::inverse), but only the first `rows` rows of the plane are made; the rest is left as it is.
    ///
    /// # Panics
    /// When a slice has the wrong length or `rows > height`.
    pub fn inverse_partly(&self, spectrum: &[Complex<T>], plane: &mut [T], rows: usize, scratch: &mut FftScratch<T>) {
        assert_eq!(
            (plane.len(), spectrum.len()),
            (self.width * self.height, self.spectrum_len()),
            "lengths do not fit"
        );
        assert!(rows <= self.height, "more rows than there are");
        let (columns, even) = (self.columns(), self.width.is_multiple_of(2));
        let factor = T::one() / T::from_usize(self.width * self.height).unwrap_or_else(T::one);
        let work = self.prepare(scratch);
        let (bins, turned) = work.pair;
        bins.copy_from_slice(spectrum);
        self.columns_back.process_with_scratch(bins, work.fft);
        transpose(bins, turned, self.height);
        for (turned, row) in turned.chunks_exact_mut(columns).zip(plane.chunks_exact_mut(self.width)).take(rows) {
            turned[0].im = T::zero();
            if even {
                turned[columns - 1].im = T::zero();
            }
            let done = self.rows_back.process_with_scratch(turned, row, work.fft);
            debug_assert!(done.is_ok());
            row.iter_mut().for_each(|v| *v = *v * factor);
        }
    }

    fn prepare<'a>(&self, scratch: &'a mut FftScratch<T>) -> Work<'a, T> {
        let bins = self.spectrum_len();
        let fft = self
            .rows
            .get_scratch_len()
            .max(self.rows_back.get_scratch_len())
            .max(self.columns.get_inplace_scratch_len())
            .max(self.columns_back.get_inplace_scratch_len());
        grow(&mut scratch.row, self.width, T::zero());
        grow(&mut scratch.turned, 2 * bins, Complex::new(T::zero(), T::zero()));
        grow(&mut scratch.fft, fft, Complex::new(T::zero(), T::zero()));
        let (first, second) = scratch.turned[..2 * bins].split_at_mut(bins);
        Work { row: &mut scratch.row[..self.width], pair: (first, second), fft: &mut scratch.fft[..fft] }
    }
}

impl<T: FftNum> std::fmt::Debug for RealFft2<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "RealFft2({}x{})", self.width, self.height)
    }
}

struct Work<'a, T> {
    row: &'a mut [T],
    pair: (&'a mut [Complex<T>], &'a mut [Complex<T>]),
    fft: &'a mut [Complex<T>],
}

fn grow<V: Clone>(buffer: &mut Vec<V>, len: usize, zero: V) {
    if buffer.len() < len {
        buffer.resize(len, zero);
    }
}

/// `from` has rows of `width`; `to` becomes its transpose.
fn transpose<V: Copy>(from: &[V], to: &mut [V], width: usize) {
    let height = from.len() / width;
    // Blocks of rows keep both sides in the first-level cache.
    const BLOCK: usize = 8;
    for top in (0..height).step_by(BLOCK) {
        let bottom = (top + BLOCK).min(height);
        for x in 0..width {
            let line = &mut to[x * height + top..x * height + bottom];
            for (value, y) in line.iter_mut().zip(top..) {
                *value = from[y * width + x];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fourier::twin;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn equals_the_sum_it_stands_for(w in 1usize..20, h in 1usize..20, seed in 0u32..1000) {
            let plane: Vec<f64> = (0..w * h).map(|i| f64::from((i as u32 * 7919 + seed * 31) % 257) / 64.0 - 2.0).collect();
            let plan = RealFft2::<f64>::new(w, h);
            let mut scratch = FftScratch::default();
            let mut spectrum = vec![Complex::default(); plan.spectrum_len()];
            plan.forward(&plane, &mut spectrum, &mut scratch);
            for u in 0..plan.columns() {
                for v in 0..h {
                    let slow = twin::dft_bin(&plane, w, u, v);
                    prop_assert!((spectrum[u * h + v] - slow).norm() < 1e-10 * (w * h) as f64);
                }
            }
            let mut back = vec![0.0; w * h];
            plan.inverse(&spectrum, &mut back, &mut scratch);
            prop_assert!(back.iter().zip(&plane).all(|(a, b)| (a - b).abs() < 1e-11));
            // Parseval, with the bins of the half spectrum counted as often as they occur in the whole one.
            let energy: f64 = plane.iter().map(|v| v * v).sum();
            let bins: f64 = (0..plan.columns())
                .map(|u| plan.multiplicity(u) as f64 * spectrum[u * h..][..h].iter().map(Complex::norm_sqr).sum::<f64>())
                .sum();
            prop_assert!((bins / (w * h) as f64 - energy).abs() < 1e-9 * energy.max(1.0));
        }
    }

    #[test]
    fn single_precision_round_trip_and_partial_inverse() {
        let (w, h) = (50, 36);
        let plane: Vec<f32> = (0..w * h).map(|i| ((i * 7919) % 257) as f32 / 128.0 - 1.0).collect();
        let (plan, mut scratch) = (RealFft2::<f32>::new(w, h), FftScratch::default());
        let mut spectrum = vec![Complex::default(); plan.spectrum_len()];
        plan.forward(&plane, &mut spectrum, &mut scratch);
        let mut back = vec![9.0; w * h];
        plan.inverse_partly(&spectrum, &mut back, 10, &mut scratch);
        assert!(back[..10 * w].iter().zip(&plane).all(|(a, b)| (a - b).abs() < 5e-7));
        assert!(back[10 * w..].iter().all(|&v| v == 9.0));
    }
}
