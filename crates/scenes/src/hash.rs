//! Randomness as a pure function: every number is a hash of what it belongs to, so nothing has to be drawn in order.

/// A well mixed 64-bit value of two others (SplitMix64's finaliser, Steele, Lea & Flood 2014).
pub(crate) fn mix(a: u64, b: u64) -> u64 {
    let mut z = a.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ b.wrapping_add(0x632b_e59b_d9b4_e019);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A uniform number in `[0, 1)`.
pub(crate) fn unit(a: u64, b: u64) -> f64 {
    (mix(a, b) >> 11) as f64 / (1u64 << 53) as f64
}

/// A uniform number in `[low, high)`.
pub(crate) fn between(a: u64, b: u64, low: f64, high: f64) -> f64 {
    low + (high - low) * unit(a, b)
}

/// A standard normal number (Box & Muller 1958).
pub(crate) fn normal(a: u64, b: u64) -> f64 {
    let (u, v) = (1.0 - unit(a, 2 * b), unit(a, 2 * b + 1));
    (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}

/// A 32-bit hash that vectorises (two multiplications; constants of Wellons' `lowbias32` search).
#[inline(always)]
pub(crate) fn mix32(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// Turns 32 random bits into a nearly normal number with variance 1: the sum of their four bytes, standardised.
/// Its tails end at ±3.45, as a sensor's well-behaved noise does for all a tracker can tell.
#[inline(always)]
pub(crate) fn nearly_normal(bits: u32) -> f32 {
    // Sum of four uniform bytes: mean 510, variance 4 · (256² - 1) / 12.
    let sum = (bits & 255) + ((bits >> 8) & 255) + ((bits >> 16) & 255) + (bits >> 24);
    (sum as i32 - 510) as f32 * (1.0 / 147.799_87)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moments(values: impl Iterator<Item = f64>) -> (f64, f64) {
        let (mut n, mut sum, mut squares) = (0.0, 0.0, 0.0);
        values.for_each(|v| (n, sum, squares) = (n + 1.0, sum + v, squares + v * v));
        (sum / n, squares / n - (sum / n).powi(2))
    }

    #[test]
    fn numbers_have_the_moments_they_claim() {
        let (mean, variance) = moments((0..40_000).map(|k| unit(7, k)));
        assert!((mean - 0.5).abs() < 0.01 && (variance - 1.0 / 12.0).abs() < 0.003, "{mean} {variance}");
        let (mean, variance) = moments((0..40_000).map(|k| normal(7, k)));
        assert!(mean.abs() < 0.02 && (variance - 1.0).abs() < 0.03, "{mean} {variance}");
        let (mean, variance) = moments((0..40_000).map(|k| nearly_normal(mix32(k)).into()));
        assert!(mean.abs() < 0.02 && (variance - 1.0).abs() < 0.03, "{mean} {variance}");
    }
}
