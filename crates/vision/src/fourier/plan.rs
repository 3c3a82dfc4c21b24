use pursuit_geometry::Size;
use rustfft::{Fft, FftNum, FftPlanner, num_complex::Complex};
use std::ops::Range;
use std::sync::Arc;

/// Plans of the discrete Fourier transform of real planes of one size, and back.
///
/// A plane has `width · height` values, row by row. Its spectrum has `(width/2 + 1) · height` bins, *column by column*: bin
/// `(u, v)`, `u` cycles across the width and `v` down the height, stands at `u·height + v`; the bins with `u > width/2` are
/// the conjugates of those at `(width − u, −v)`. The forward transform is `Σ f(x, y)·exp(−2πi(ux/width + vy/height))`,
/// without a factor; the inverse divides by `width · height`.
///
/// Rows are transformed two at a time, as the real and the imaginary part of one; that takes no more arithmetic than
/// transforms made for real values, and all rows are one call.
///
/// Cloning shares the plans. Any size works; 5-smooth ones ([`good_size`](super::good_size)) are fast.
#[derive(Clone)]
pub struct RealFft2<T: FftNum = f32> {
    width: usize,
    height: usize,
    rows: Arc<dyn Fft<T>>,
    rows_back: Arc<dyn Fft<T>>,
    columns: Arc<dyn Fft<T>>,
    columns_back: Arc<dyn Fft<T>>,
}

/// Working memory of a [`RealFft2`]; not state. One may serve plans of several sizes: it grows to the largest.
#[derive(Debug, Clone, Default)]
pub struct FftScratch<T = f32> {
    bins: Vec<Complex<T>>,
    pairs: Vec<Complex<T>>,
    fft: Vec<Complex<T>>,
}

impl<T: FftNum> RealFft2<T> {
    /// Plans for planes of `width` × `height` values (at least 1 × 1).
    pub fn new(width: usize, height: usize) -> Self {
        let (width, height) = (width.max(1), height.max(1));
        let mut planner = FftPlanner::new();
        Self {
            width,
            height,
            rows: planner.plan_fft_forward(width),
            rows_back: planner.plan_fft_inverse(width),
            columns: planner.plan_fft_forward(height),
            columns_back: planner.plan_fft_inverse(height),
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
        self.forward_rows(plane, 0..self.height, spectrum, scratch);
    }

    /// As [`forward`](Self::forward) of a plane that is zero outside of `rows`, whatever `plane` holds there.
    ///
    /// # Panics
    /// When a slice has the wrong length or there are no such rows.
    pub fn forward_rows(
        &self,
        plane: &[T],
        rows: Range<usize>,
        spectrum: &mut [Complex<T>],
        scratch: &mut FftScratch<T>,
    ) {
        self.check(plane.len(), spectrum.len(), &rows);
        let (width, height, zero) = (self.width, self.height, T::zero());
        let Work { pairs, fft, .. } = self.prepare(scratch, rows.len());
        let given = plane[rows.start * width..rows.end * width].chunks(2 * width);
        for (pair, given) in pairs.chunks_exact_mut(width).zip(given) {
            match given.split_at(width) {
                (even, []) => pair.iter_mut().zip(even).for_each(|(z, &a)| *z = Complex::new(a, zero)),
                (even, odd) => {
                    pair.iter_mut().zip(even.iter().zip(odd)).for_each(|(z, (&a, &b))| *z = Complex::new(a, b));
                }
            }
        }
        self.rows.process_with_scratch(pairs, fft);
        if rows.len() < height {
            spectrum.fill(Complex::new(zero, zero));
        }
        let half = T::one() / (T::one() + T::one());
        for (pair, y) in pairs.chunks_exact(width).zip(rows.clone().step_by(2)) {
            // Of z = a + ib, a and b real: A(u) = (Z(u) + Z*(−u))/2, B(u) = (Z(u) − Z*(−u))/2i.
            let whole = y + 1 < rows.end;
            for u in 0..=width / 2 {
                let (z, m) = (pair[u], pair[if u == 0 { 0 } else { width - u }]);
                let at = u * height + y;
                spectrum[at] = Complex::new((z.re + m.re) * half, (z.im - m.im) * half);
                if whole {
                    spectrum[at + 1] = Complex::new((z.im + m.im) * half, (m.re - z.re) * half);
                }
            }
        }
        self.columns.process_with_scratch(spectrum, fft);
    }

    /// The plane of `spectrum`; the imaginary parts of bins that must be real are ignored.
    ///
    /// # Panics
    /// When a slice has the wrong length.
    pub fn inverse(&self, spectrum: &[Complex<T>], plane: &mut [T], scratch: &mut FftScratch<T>) {
        self.inverse_rows(spectrum, plane, 0..self.height, scratch);
    }

    /// As [`inverse`](Self::inverse), but only these `rows` of the plane are made; the rest is left as it is.
    ///
    /// # Panics
    /// When a slice has the wrong length or there are no such rows.
    pub fn inverse_rows(
        &self,
        spectrum: &[Complex<T>],
        plane: &mut [T],
        rows: Range<usize>,
        scratch: &mut FftScratch<T>,
    ) {
        self.check(plane.len(), spectrum.len(), &rows);
        let (width, height, zero) = (self.width, self.height, T::zero());
        let Work { bins, pairs, fft } = self.prepare(scratch, rows.len());
        bins.copy_from_slice(spectrum);
        self.columns_back.process_with_scratch(bins, fft);
        let none = Complex::new(zero, zero);
        for (pair, y) in pairs.chunks_exact_mut(width).zip(rows.clone().step_by(2)) {
            let whole = y + 1 < rows.end;
            for u in 0..=width / 2 {
                let at = u * height + y;
                let (mut a, mut b) = (bins[at], if whole { bins[at + 1] } else { none });
                if u == 0 || 2 * u == width {
                    (a.im, b.im) = (zero, zero);
                }
                // Z = A + iB, and A and B are Hermitian.
                pair[u] = Complex::new(a.re - b.im, a.im + b.re);
                if u > 0 {
                    pair[width - u] = Complex::new(a.re + b.im, b.re - a.im);
                }
            }
        }
        self.rows_back.process_with_scratch(pairs, fft);
        let factor = T::one() / T::from_usize(width * height).unwrap_or_else(T::one);
        let wanted = plane[rows.start * width..rows.end * width].chunks_mut(2 * width);
        for (pair, wanted) in pairs.chunks_exact(width).zip(wanted) {
            let (even, odd) = wanted.split_at_mut(width);
            even.iter_mut().zip(pair).for_each(|(v, z)| *v = z.re * factor);
            odd.iter_mut().zip(pair).for_each(|(v, z)| *v = z.im * factor);
        }
    }

    fn check(&self, plane: usize, spectrum: usize, rows: &Range<usize>) {
        assert_eq!((plane, spectrum), (self.width * self.height, self.spectrum_len()), "lengths do not fit");
        assert!(rows.start <= rows.end && rows.end <= self.height, "more rows than there are");
    }

    fn prepare<'a>(&self, scratch: &'a mut FftScratch<T>, rows: usize) -> Work<'a, T> {
        let (bins, pairs) = (self.spectrum_len(), self.height.div_ceil(2) * self.width);
        let lengths =
            [&self.rows, &self.rows_back, &self.columns, &self.columns_back].map(|f| f.get_inplace_scratch_len());
        let fft = lengths.into_iter().fold(0, usize::max);
        grow(&mut scratch.bins, bins);
        grow(&mut scratch.pairs, pairs);
        grow(&mut scratch.fft, fft);
        Work {
            bins: &mut scratch.bins[..bins],
            pairs: &mut scratch.pairs[..rows.div_ceil(2) * self.width],
            fft: &mut scratch.fft[..fft],
        }
    }
}

impl<T: FftNum> std::fmt::Debug for RealFft2<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "RealFft2({}x{})", self.width, self.height)
    }
}

struct Work<'a, T> {
    /// A spectrum.
    bins: &'a mut [Complex<T>],
    /// Rows, two in one.
    pairs: &'a mut [Complex<T>],
    fft: &'a mut [Complex<T>],
}

fn grow<T: FftNum>(buffer: &mut Vec<Complex<T>>, len: usize) {
    if buffer.len() < len {
        buffer.resize(len, Complex::new(T::zero(), T::zero()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fourier::reference;
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
                    let slow = reference::dft_bin(&plane, w, u, v);
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
    fn single_precision_round_trip_and_some_rows_only() {
        for (w, h) in [(50, 36), (9, 7)] {
            let plane: Vec<f32> = (0..w * h).map(|i| ((i * 7919) % 257) as f32 / 128.0 - 1.0).collect();
            let (plan, mut scratch) = (RealFft2::<f32>::new(w, h), FftScratch::default());
            let mut spectrum = vec![Complex::default(); plan.spectrum_len()];
            plan.forward(&plane, &mut spectrum, &mut scratch);
            for rows in [0..h, 0..5, 2..5, 3..h, 4..4] {
                let mut back = vec![9.0; w * h];
                plan.inverse_rows(&spectrum, &mut back, rows.clone(), &mut scratch);
                let mut banded = plane.clone();
                for (y, (row, want)) in back.chunks_exact(w).zip(banded.chunks_exact_mut(w)).enumerate() {
                    if rows.contains(&y) {
                        assert!(row.iter().zip(&*want).all(|(a, b)| (a - b).abs() < 5e-7), "{rows:?} {y}");
                    } else {
                        assert!(row.iter().all(|&v| v == 9.0));
                        want.fill(0.0);
                    }
                }
                let (mut band, mut whole) = (spectrum.clone(), spectrum.clone());
                plan.forward_rows(&plane, rows.clone(), &mut band, &mut scratch);
                plan.forward(&banded, &mut whole, &mut scratch);
                assert!(band.iter().zip(&whole).all(|(a, b)| (a - b).norm() < 1e-4), "{rows:?}");
            }
        }
    }
}
