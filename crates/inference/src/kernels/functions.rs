//! Functions of sixteen numbers at a time, as exact as single precision asks for.

use fearless_simd::{Simd, f32x16, prelude::*, u32x16};

/// ln 2 in two parts, of which the first has so few digits that a whole multiple of it is exact.
const LN_2: [f32; 2] = [0.693_359_4, -2.121_944_4e-4];

/// eˣ, for x from −87 to 88; beyond, that of the nearest of the two. Relative error below 3e-7.
#[inline(always)]
pub fn exp<S: Simd>(x: f32x16<S>) -> f32x16<S> {
    let x = x.max(-87.0).min(88.0);
    // eˣ = 2ⁿ eᶠ with |f| ≤ ln 2 / 2.
    let n = (x * std::f32::consts::LOG2_E).round_ties_even();
    let f = n.mul_add(-LN_2[1], n.mul_add(-LN_2[0], x));
    let mut sum = f32x16::splat(x.simd, 1.0 / 5040.0);
    for term in [1.0 / 720.0, 1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5, 1.0, 1.0] {
        sum = sum.mul_add(f, term);
    }
    // n + 127 is the exponent of a number in single precision.
    let power = (n + 127.0).to_int::<u32x16<S>>() << 23;
    sum * f32x16::from_bits(power)
}

/// x (1 + erf(x / √2)) / 2, by the rational approximation of erf with an error below 1.5e-7 (Abramowitz and Stegun 1964, 7.1.26).
#[inline(always)]
pub fn gelu<S: Simd>(x: f32x16<S>) -> f32x16<S> {
    let z = x.abs() * std::f32::consts::FRAC_1_SQRT_2;
    let t = 1.0 / z.mul_add(0.327_591_1, 1.0);
    let mut sum = f32x16::splat(x.simd, 1.061_405_4);
    for term in [-1.453_152, 1.421_413_7, -0.284_496_74, 0.254_829_6] {
        sum = sum.mul_add(t, term);
    }
    let erf = 1.0 - sum * t * exp(-(z * z));
    x * 0.5 * (erf.copysign(x) + 1.0)
}

/// The same, one number at a time and in double precision.
#[cfg(test)]
pub mod reference {
    /// By the power series of erf about nought, and nought or x where the rest is below all digits.
    pub fn gelu(x: f32) -> f32 {
        let x = f64::from(x);
        if x.abs() > 6.0 {
            return x.max(0.0) as f32;
        }
        let z = x / std::f64::consts::SQRT_2;
        let (mut term, mut sum) = (z, z);
        for n in 1..200 {
            term *= -z * z / f64::from(n);
            sum += term / f64::from(2 * n + 1);
        }
        (x * 0.5 * (1.0 + sum * std::f64::consts::FRAC_2_SQRT_PI)) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fearless_simd::{Level, dispatch};

    #[test]
    fn powers_of_e_are_exact_to_seven_digits() {
        for i in -8600..=8700 {
            let x = i as f32 / 100.0;
            let got = dispatch!(Level::new(), simd => exp(f32x16::splat(simd, x)).to_array())[5];
            let want = f64::from(x).exp();
            assert!((f64::from(got) / want - 1.0).abs() < 5e-7, "e^{x} is {want}, not {got}");
        }
        let least = dispatch!(Level::new(), simd => exp(f32x16::splat(simd, -1e9)).to_array())[0];
        assert!(least > 0.0 && least < 1e-36);
    }

    #[test]
    fn gelu_is_exact_to_six_digits() {
        for i in -900..=900 {
            let x = i as f32 / 100.0;
            let got = dispatch!(Level::new(), simd => gelu(f32x16::splat(simd, x)).to_array())[3];
            assert!((got - reference::gelu(x)).abs() < 1e-6 * x.abs().max(1.0), "gelu({x}) is not {got}");
        }
    }
}
