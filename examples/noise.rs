//! Numbers that look random and are the same in every run.

/// A number of the normal distribution with mean 0 and deviation 1, the same for the same `k`.
pub fn normal(k: u64) -> f64 {
    let [a, b] = [uniform(2 * k), uniform(2 * k + 1)];
    (-2.0 * a.ln()).sqrt() * (std::f64::consts::TAU * b).cos() // Box and Muller 1958
}

/// A number above 0 and at most 1, the same for the same `k` (splitmix64).
fn uniform(k: u64) -> f64 {
    let mut z = k.wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    (((z ^ (z >> 31)) >> 11) + 1) as f64 / (1_u64 << 53) as f64
}
