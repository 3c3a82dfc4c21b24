//! Grey values freed of light and contrast.

use multiversion::multiversion;

/// Sums that are kept side by side.
const LANES: usize = 16;

/// ln (v + 1) of every value v ≥ 0, less the mean, divided by the standard deviation (bolme2010, section 3.1): neither light
/// nor contrast matters afterwards. Flat values become 0.
#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
pub fn log_standardize(values: &mut [f32]) {
    for v in values.iter_mut() {
        *v = ln(*v + 1.0);
    }
    let n = values.len().max(1) as f32;
    let mean = sum_of(values, |v| v) / n;
    for v in values.iter_mut() {
        *v -= mean;
    }
    let variance = sum_of(values, |v| v * v) / n;
    let scale = if variance > 1e-9 { variance.sqrt().recip() } else { 0.0 };
    for v in values.iter_mut() {
        *v *= scale;
    }
}

/// Σ f(v), summed side by side.
#[inline(always)]
fn sum_of(values: &[f32], f: impl Fn(f32) -> f32) -> f32 {
    let mut sums = [0.0f32; LANES];
    let (whole, rest) = values.as_chunks::<LANES>();
    for chunk in whole {
        for k in 0..LANES {
            sums[k] += f(chunk[k]);
        }
    }
    sums.iter().sum::<f32>() + rest.iter().map(|v| f(*v)).sum::<f32>()
}

/// ln x of a normal positive number, without a branch: x = 2ᵉ·m with m in [√½, √2), and ln m = 2 artanh s by its series, with
/// s = (m − 1) / (m + 1), so |s| < 0.172 and s¹¹ / 11 is below what a float resolves.
#[inline(always)]
fn ln(x: f32) -> f32 {
    const ROOT_HALF: u32 = 0x3f35_04f3;
    let bits = x.to_bits().wrapping_sub(ROOT_HALF);
    let exponent = (bits as i32) >> 23;
    let m = f32::from_bits((bits & 0x007f_ffff).wrapping_add(ROOT_HALF));
    let s = (m - 1.0) / (m + 1.0);
    let s2 = s * s;
    let series = 2.0 + s2 * (2.0 / 3.0 + s2 * (2.0 / 5.0 + s2 * (2.0 / 7.0 + s2 * (2.0 / 9.0))));
    exponent as f32 * std::f32::consts::LN_2 + s * series
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_logarithm_is_exact_to_a_float() {
        for v in (0..=255 * 64).map(|i| i as f32 / 64.0).chain([1e-7, 0.999_999, 1e6, 3e30]) {
            let want = (f64::from(v) + 1.0).ln();
            assert!((f64::from(ln(v + 1.0)) - want).abs() <= 3e-7 * (1.0 + want), "{v}: {} for {want}", ln(v + 1.0));
        }
        assert_eq!(ln(1.0), 0.0);
    }

    #[test]
    fn neither_light_nor_contrast_matters() {
        let plain: Vec<f32> = (0..333).map(|i| (i * 37 % 256) as f32).collect();
        let mut values = plain.clone();
        log_standardize(&mut values);
        let logs: Vec<f64> = plain.iter().map(|v| f64::from(*v).ln_1p()).collect();
        let mean = logs.iter().sum::<f64>() / 333.0;
        let deviation = (logs.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / 333.0).sqrt();
        for (got, log) in values.iter().zip(&logs) {
            assert!((f64::from(*got) - (log - mean) / deviation).abs() < 1e-5, "{got}");
        }
        let mut flat = [77.0; 40];
        log_standardize(&mut flat);
        assert!(flat.iter().all(|v| v.abs() < 1e-6), "{flat:?}");
        log_standardize(&mut []);
        log_standardize(&mut [f32::NAN, f32::INFINITY, -1.0, -5.0]);
    }
}
