use multiversion::multiversion;

/// Log odds beyond this are as good as certain: products of so many probabilities stay numbers.
const MOST: f32 = 8.0;

/// Σ ln(1 − σ(aᵢ + bᵢ)) over all i: how likely none of several things is, from the log odds of each.
///
/// The probabilities are multiplied lane by lane and one logarithm taken of each lane.
pub(super) fn log_none(a: &[f32], b: &[f32]) -> f32 {
    // So many factors of at least 1 / (1 + e⁸) stay above the least number.
    a.chunks(8 * LANES).zip(b.chunks(8 * LANES)).map(|(a, b)| of_chunk(a, b)).sum()
}

const LANES: usize = 8;

#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn of_chunk(a: &[f32], b: &[f32]) -> f32 {
    let mut products = [1.0f32; LANES];
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<LANES>(), b.as_chunks::<LANES>());
    for (a, b) in a.iter().zip(b) {
        for i in 0..LANES {
            products[i] *= 1.0 / (1.0 + exp((a[i] + b[i]).clamp(-MOST, MOST)));
        }
    }
    for (i, (a, b)) in a_rest.iter().zip(b_rest).enumerate() {
        products[i] *= 1.0 / (1.0 + exp((a + b).clamp(-MOST, MOST)));
    }
    products.iter().map(|p| p.ln()).sum()
}

/// e^v to about one part in 10⁶, for −87 ≤ v ≤ 87, without a branch: 2^k of the nearest whole k times a polynomial of the rest.
#[inline(always)]
pub(super) fn exp(v: f32) -> f32 {
    let t = v * std::f32::consts::LOG2_E;
    let k = (t + ROUNDING) - ROUNDING;
    let r = (t - k) * std::f32::consts::LN_2;
    let p = 1.0 + r * (1.0 + r * (0.5 + r * (1.0 / 6.0 + r * (1.0 / 24.0 + r * (1.0 / 120.0 + r / 720.0)))));
    f32::from_bits(((k as i32 + 127) as u32) << 23) * p
}

/// Adding and taking it away again rounds to whole numbers: 1.5 · 2²³.
const ROUNDING: f32 = 12_582_912.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_are_those_of_the_library() {
        for k in -860..=860 {
            let v = k as f32 / 10.0;
            let (got, want) = (f64::from(exp(v)), f64::from(v).exp());
            assert!((got / want - 1.0).abs() < 2e-5, "{v}: {got} is not {want}");
        }
    }

    #[test]
    fn none_of_many_is_a_product() {
        let a: Vec<f32> = (0..131).map(|k| (k as f32 * 0.37).sin() * 5.0).collect();
        let b: Vec<f32> = (0..131).map(|k| (k as f32 * 0.71).cos() * 2.0).collect();
        let slow: f64 = a.iter().zip(&b).map(|(a, b)| -f64::from(a + b).exp().ln_1p()).sum();
        assert!((f64::from(log_none(&a, &b)) - slow).abs() < 1e-3 * slow.abs(), "{slow}");
        let sure = [100.0; 131];
        assert!(log_none(&sure, &b).is_finite());
        assert_eq!(log_none(&[], &[]), 0.0);
    }
}
