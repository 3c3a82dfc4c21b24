//! The slow, obvious transform that the fast one is held against.

use rustfft::num_complex::Complex;
use std::f64::consts::TAU;

/// Bin `(u, v)` of the spectrum of `plane`, by the sum that defines it.
pub fn dft_bin(plane: &[f64], width: usize, u: usize, v: usize) -> Complex<f64> {
    let height = plane.len() / width;
    let mut sum = Complex::new(0.0, 0.0);
    for y in 0..height {
        for x in 0..width {
            let turns = (u * x) as f64 / width as f64 + (v * y) as f64 / height as f64;
            sum += Complex::from_polar(1.0, -TAU * turns) * plane[y * width + x];
        }
    }
    sum
}
