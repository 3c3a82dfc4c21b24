//! From samples on a grid to a function of a continuous place (danelljan2016, section 3.2).

use super::coefficients::{count, order_of};
use pursuit_vision::fourier::Complex32;
use std::f64::consts::{PI, TAU};

/// The Fourier transform at `f` cycles a sample of the cubic convolution kernel b with parameter `a` (keys1981), which is
/// `(a + 2)|t|³ − (a + 3)|t|² + 1` up to |t| = 1, `a|t|³ − 5a|t|² + 8a|t| − 4a` up to 2 and 0 beyond.
fn kernel_transform(a: f64, f: f64) -> f64 {
    let w = TAU * f;
    if w.abs() < 0.05 {
        // The fraction below loses its digits here: ∫ b = 1 and ∫ t²·b = 2 (1 + 2a)/15 say as much.
        return 1.0 - w * w * (1.0 + 2.0 * a) / 15.0;
    }
    let ((sin, cos), (sin2, cos2)) = (w.sin_cos(), (2.0 * w).sin_cos());
    let numerator = 24.0 * (1.0 - cos) + 12.0 * a * (1.0 - cos2) - (16.0 * a + 12.0) * w * sin - 4.0 * a * w * sin2;
    numerator / w.powi(4)
}

/// What the discrete Fourier transform of n × n samples is multiplied by such that it becomes the Fourier coefficients of
/// J{x}(t) = Σ x[m]·b(n·t − m − ½) over one period (danelljan2016, eq. 3 and 12), for each of `at` that n samples tell.
/// Half a sample, so that grids of different cells agree on where they are.
pub(super) fn interpolation(a: f64, n: usize, at: &[(usize, isize)]) -> Vec<Complex32> {
    let axis = |k: f64| {
        let (sin, cos) = (PI * k / n as f64).sin_cos();
        let size = kernel_transform(a, k / n as f64) / n as f64;
        (size * cos, -size * sin)
    };
    let product = |&(u, v): &(usize, isize)| {
        let ((a, b), (c, d)) = (axis(u as f64), axis(v as f64));
        Complex32::new((a * c - b * d) as f32, (a * d + b * c) as f32)
    };
    at[..count(order_of(n)).min(at.len())].iter().map(product).collect()
}

/// The Fourier coefficients of a Gaussian of height 1 about 0, repeated with period 1, with a standard deviation of `sigma`
/// periods (danelljan2016, eq. 16).
pub(super) fn label(sigma: f64, at: &[(usize, isize)]) -> Vec<f32> {
    let axis = |k: f64| TAU.sqrt() * sigma * (-2.0 * (PI * sigma * k).powi(2)).exp();
    at.iter().map(|&(u, v)| (axis(u as f64) * axis(v as f64)) as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::super::coefficients::frequencies;
    use super::*;
    use pursuit_testkit::SplitMix;
    use pursuit_vision::fourier::{FftScratch, RealFft2};

    fn kernel(a: f64, t: f64) -> f64 {
        match t.abs() {
            t if t <= 1.0 => (a + 2.0) * t.powi(3) - (a + 3.0) * t * t + 1.0,
            t if t <= 2.0 => a * t.powi(3) - 5.0 * a * t * t + 8.0 * a * t - 4.0 * a,
            _ => 0.0,
        }
    }

    #[test]
    fn the_transform_is_that_of_the_kernel() {
        let steps = 40_000;
        for a in [-0.75, -0.5, 0.0] {
            for f in [0.0, 0.004, 0.0079, 0.0081, 0.1, 0.37, 0.5] {
                let term = |i: usize| {
                    let t = -2.0 + 4.0 * (i as f64 + 0.5) / steps as f64;
                    kernel(a, t) * (TAU * f * t).cos()
                };
                let want = (0..steps).map(term).sum::<f64>() * 4.0 / steps as f64;
                let got = kernel_transform(a, f);
                assert!((got - want).abs() < 1e-6, "{a} {f}: {got} is not {want}");
            }
        }
    }

    /// By the definition: the function is summed from its samples on a fine grid, and transformed by the integral.
    #[test]
    fn coefficients_are_those_of_the_interpolated_function() {
        let (a, n, fine) = (-0.75, 6, 96);
        let at = frequencies(&[order_of(n)]);
        let mut numbers = SplitMix::after(3);
        let samples: Vec<f32> = (0..n * n).map(|_| numbers.unit() as f32 - 0.5).collect();
        let weight = |t: f64, m: usize| {
            let shifts = [-1.0, 0.0, 1.0].map(|period| kernel(a, n as f64 * (t + period) - m as f64 - 0.5));
            shifts.iter().sum::<f64>()
        };
        let place = |i: usize| (i as f64 + 0.5) / fine as f64;
        let value = |i: usize, j: usize| -> f64 {
            let (x, y) = (place(i), place(j));
            let row = |q: usize| (0..n).map(|p| f64::from(samples[q * n + p]) * weight(x, p)).sum::<f64>();
            (0..n).map(|q| row(q) * weight(y, q)).sum()
        };
        let values: Vec<f64> = (0..fine * fine).map(|k| value(k % fine, k / fine)).collect();
        let plan = RealFft2::new(n, n);
        let mut bins = vec![Complex32::default(); plan.spectrum_len()];
        plan.forward(&samples, &mut bins, &mut FftScratch::default());
        for (&(u, v), factor) in at.iter().zip(interpolation(a, n, &at)) {
            let got = bins[u * n + v.rem_euclid(n as isize) as usize] * factor;
            let (mut re, mut im) = (0.0, 0.0);
            for (k, value) in values.iter().enumerate() {
                let turn = TAU * (u as f64 * place(k % fine) + v as f64 * place(k / fine));
                re += value * turn.cos() / (fine * fine) as f64;
                im -= value * turn.sin() / (fine * fine) as f64;
            }
            let apart = (f64::from(got.re) - re).hypot(f64::from(got.im) - im);
            assert!(apart < 2e-4, "({u}, {v}): {got} is not {re} {im}");
        }
    }

    #[test]
    fn the_label_is_a_gaussian() {
        let (sigma, at) = (0.06, frequencies(&[12]));
        let coefficients = label(sigma, &at);
        for (x, y) in [(0.0, 0.0), (0.05, 0.02), (0.9, 0.1), (0.5, 0.5)] {
            let term = |(&(u, v), c): (&(usize, isize), &f32)| {
                let twice = if (u, v) == (0, 0) { 1.0 } else { 2.0 };
                twice * f64::from(*c) * (TAU * (u as f64 * x + v as f64 * y)).cos()
            };
            let got: f64 = at.iter().zip(&coefficients).map(term).sum();
            let away = |t: f64| (t - t.round()) / sigma;
            let want = (-0.5 * (away(x).powi(2) + away(y).powi(2))).exp();
            assert!((got - want).abs() < 1e-4, "({x}, {y}): {got} is not {want}");
        }
    }
}
