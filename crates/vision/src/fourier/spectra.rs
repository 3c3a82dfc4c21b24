//! Sums and products of spectra, bin by bin; every slice has one value a bin.
//!
//! Chosen at run time for the processor (AVX2 with fused multiply-add, NEON or plain).

use super::Complex32;
use multiversion::multiversion;

/// `sum += conj(a) · b`: correlation in the frequency domain.
#[multiversion(targets("x86_64+avx2+fma", "aarch64+neon"))]
pub fn add_conj_product(sum: &mut [Complex32], a: &[Complex32], b: &[Complex32]) {
    for ((sum, a), b) in sum.iter_mut().zip(a).zip(b) {
        sum.re += a.re * b.re + a.im * b.im;
        sum.im += a.re * b.im - a.im * b.re;
    }
}

/// `sum += a · b`: convolution in the frequency domain.
#[multiversion(targets("x86_64+avx2+fma", "aarch64+neon"))]
pub fn add_product(sum: &mut [Complex32], a: &[Complex32], b: &[Complex32]) {
    for ((sum, a), b) in sum.iter_mut().zip(a).zip(b) {
        sum.re += a.re * b.re - a.im * b.im;
        sum.im += a.re * b.im + a.im * b.re;
    }
}

/// `sum += |a|²`: the energy of every bin.
#[multiversion(targets("x86_64+avx2+fma", "aarch64+neon"))]
pub fn add_power(sum: &mut [f32], a: &[Complex32]) {
    for (sum, a) in sum.iter_mut().zip(a) {
        *sum += a.re * a.re + a.im * a.im;
    }
}

/// `old += rate · (new − old)`: a running average.
#[multiversion(targets("x86_64+avx2+fma", "aarch64+neon"))]
pub fn blend(old: &mut [Complex32], new: &[Complex32], rate: f32) {
    for (old, new) in old.iter_mut().zip(new) {
        old.re += rate * (new.re - old.re);
        old.im += rate * (new.im - old.im);
    }
}

/// `old += rate · (new − old)` of real values.
#[multiversion(targets("x86_64+avx2+fma", "aarch64+neon"))]
pub fn blend_real(old: &mut [f32], new: &[f32], rate: f32) {
    for (old, new) in old.iter_mut().zip(new) {
        *old += rate * (new - *old);
    }
}

/// Sums that are kept side by side.
const LANES: usize = 8;

/// Σ v² of real values.
#[multiversion(targets("x86_64+avx2+fma", "aarch64+neon"))]
pub fn energy_real(values: &[f32]) -> f64 {
    let mut sums = [0.0f64; LANES];
    let (whole, rest) = values.as_chunks::<LANES>();
    for chunk in whole {
        for k in 0..LANES {
            sums[k] += f64::from(chunk[k] * chunk[k]);
        }
    }
    sums.iter().sum::<f64>() + rest.iter().map(|v| f64::from(v * v)).sum::<f64>()
}

/// Σ |a|² over the bins given, each once (see [`RealFft2::multiplicity`](super::RealFft2::multiplicity)).
#[multiversion(targets("x86_64+avx2+fma", "aarch64+neon"))]
pub fn energy(a: &[Complex32]) -> f64 {
    let mut sums = [0.0f64; LANES];
    let (whole, rest) = a.as_chunks::<LANES>();
    for chunk in whole {
        for k in 0..LANES {
            sums[k] += f64::from(chunk[k].re * chunk[k].re + chunk[k].im * chunk[k].im);
        }
    }
    sums.iter().sum::<f64>() + rest.iter().map(|a| f64::from(a.norm_sqr())).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn energies_are_the_sums_of_squares() {
        let values: Vec<f32> = (0..53).map(|i| (i * 29 % 31) as f32 / 8.0 - 1.5).collect();
        let want: f64 = values.iter().map(|v| f64::from(*v).powi(2)).sum();
        assert!((energy_real(&values) - want).abs() < 1e-5 * want);
        let bins: Vec<Complex32> = values.windows(2).map(|w| Complex32::new(w[0], 2.0 * w[1])).collect();
        let want: f64 = values.windows(2).map(|w| f64::from(w[0]).powi(2) + 4.0 * f64::from(w[1]).powi(2)).sum();
        assert!((energy(&bins) - want).abs() < 1e-5 * want);
        assert_eq!((energy_real(&[]), energy(&[])), (0.0, 0.0));
    }

    #[test]
    fn bin_by_bin_as_the_formulas_say() {
        let bins = |k: u32| -> Vec<Complex32> {
            let value = |i: u32| (i * k % 17) as f32 / 4.0 - 2.0;
            (0..37).map(|i| Complex32::new(value(i + 1), value(3 * i + 2))).collect()
        };
        let (a, b, start) = (bins(5), bins(11), bins(7));
        let near = |x: &[Complex32], want: &dyn Fn(usize) -> Complex32| {
            assert!(x.iter().enumerate().all(|(i, x)| (x - want(i)).norm() < 1e-5));
        };
        let mut sum = start.clone();
        add_conj_product(&mut sum, &a, &b);
        near(&sum, &|i| start[i] + a[i].conj() * b[i]);
        let mut sum = start.clone();
        add_product(&mut sum, &a, &b);
        near(&sum, &|i| start[i] + a[i] * b[i]);
        let mut sum = start.clone();
        blend(&mut sum, &a, 0.25);
        near(&sum, &|i| start[i] * 0.75 + a[i] * 0.25);
        let (mut power, mut real) = (vec![1.0; 37], vec![1.0f32; 37]);
        add_power(&mut power, &a);
        blend_real(&mut real, &[3.0; 37], 0.5);
        assert!(power.iter().zip(&a).all(|(p, a)| (p - 1.0 - a.norm_sqr()).abs() < 1e-5));
        assert!(real.iter().all(|&v| v == 2.0));
    }
}
