//! Fourier coefficients of real functions of the plane, of bands of several widths.

use multiversion::multiversion;
use pursuit_vision::fourier::Complex32;

/// The number of coefficients of order `order` and below that say all of a real function.
pub(super) const fn count(order: usize) -> usize {
    ((2 * order + 1) * (2 * order + 1)).div_ceil(2)
}

/// The highest order that `n` samples a period tell without ambiguity.
pub(super) const fn order_of(n: usize) -> usize {
    n.saturating_sub(1) / 2
}

/// The frequencies (u, v) of half a plane, u across and v down, in the order in which coefficients are stored; those of the
/// other half are conjugates. First comes (0, 0), then the rest of the narrowest band, then what the next wider one adds:
/// coefficient *i* means the same frequency in all bands, and those that all have come first.
pub(super) fn frequencies(orders: &[usize]) -> Vec<(usize, isize)> {
    let mut orders = orders.to_vec();
    orders.sort_unstable();
    let (mut all, mut from) = (Vec::new(), 0);
    for order in orders {
        for u in 0..=order {
            let top = if u == 0 { 0 } else { -(order as isize) };
            all.extend((top..=order as isize).map(|v| (u, v)).filter(|(u, v)| {
                let ring = (*u).max(v.unsigned_abs());
                all_of(ring, from)
            }));
        }
        from = order + 1;
    }
    all
}

/// Whether a frequency of this ring is not in the bands before, which end below `from`.
const fn all_of(ring: usize, from: usize) -> bool {
    ring >= from
}

/// ∫ a·b over one period of two real functions, by Parseval's theorem.
pub(super) fn inner(a: &[Complex32], b: &[Complex32]) -> f64 {
    let (first, whole) = match (a.first(), b.first()) {
        (Some(a), Some(b)) => (f64::from(a.re * b.re + a.im * b.im), 2.0),
        _ => (0.0, 2.0),
    };
    whole * f64::from(dot(a, b)) - first
}

/// Complex numbers that are worked on side by side.
const LANES: usize = 8;

/// Σ Re(ā·b).
#[multiversion(targets("x86_64+avx2+fma", "aarch64+neon"))]
fn dot(a: &[Complex32], b: &[Complex32]) -> f32 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<LANES>(), b.as_chunks::<LANES>());
    let mut sums = [[0.0_f32; 2]; LANES];
    for (a, b) in a.iter().zip(b) {
        for k in 0..LANES {
            sums[k][0] += a[k].re * b[k].re;
            sums[k][1] += a[k].im * b[k].im;
        }
    }
    let rest: f32 = a_rest.iter().zip(b_rest).map(|(a, b)| a.re * b.re + a.im * b.im).sum();
    sums.iter().map(|s| s[0] + s[1]).sum::<f32>() + rest
}

/// `sum += factor · a`.
#[multiversion(targets("x86_64+avx2+fma", "aarch64+neon"))]
pub(super) fn add_scaled(sum: &mut [Complex32], a: &[Complex32], factor: f32) {
    for (sum, a) in sum.iter_mut().zip(a) {
        sum.re += factor * a.re;
        sum.im += factor * a.im;
    }
}

/// `a = b + factor · a`.
#[multiversion(targets("x86_64+avx2+fma", "aarch64+neon"))]
pub(super) fn scale_and_add(a: &mut [Complex32], factor: f32, b: &[Complex32]) {
    for (a, b) in a.iter_mut().zip(b) {
        a.re = b.re + factor * a.re;
        a.im = b.im + factor * a.im;
    }
}

/// `out = a · b`.
#[multiversion(targets("x86_64+avx2+fma", "aarch64+neon"))]
pub(super) fn multiply(out: &mut [Complex32], a: &[Complex32], b: &[Complex32]) {
    for (out, (a, b)) in out.iter_mut().zip(a.iter().zip(b)) {
        *out = Complex32::new(a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re);
    }
}

/// `out = ā · b`.
#[multiversion(targets("x86_64+avx2+fma", "aarch64+neon"))]
pub(super) fn multiply_conj(out: &mut [Complex32], a: &[Complex32], b: &[Complex32]) {
    for (out, (a, b)) in out.iter_mut().zip(a.iter().zip(b)) {
        *out = Complex32::new(a.re * b.re + a.im * b.im, a.re * b.im - a.im * b.re);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_testkit::SplitMix;

    #[test]
    fn every_frequency_of_half_a_plane_comes_once_and_narrow_bands_first() {
        let all = frequencies(&[4, 2]);
        assert_eq!((all.len(), count(2), count(4)), (count(4), 13, 41));
        assert_eq!(all[0], (0, 0));
        assert_eq!(all[..count(2)], frequencies(&[2]));
        let mut whole: Vec<(isize, isize)> = all.iter().map(|&(u, v)| (u as isize, v)).collect();
        whole.extend(all[1..].iter().map(|&(u, v)| (-(u as isize), -v)));
        whole.sort_unstable();
        let square: Vec<(isize, isize)> = (-4..=4).flat_map(|u| (-4..=4).map(move |v| (u, v))).collect();
        assert_eq!(whole, square);
        assert_eq!(frequencies(&[3, 3]), frequencies(&[3]));
        assert_eq!((order_of(32), order_of(33), order_of(0)), (15, 16, 0));
    }

    #[test]
    fn inner_products_are_those_of_the_functions() {
        let (order, n) = (3, 16);
        let at = frequencies(&[order]);
        let mut numbers = SplitMix::after(5);
        let mut random = || -> Vec<Complex32> {
            let mut all: Vec<Complex32> =
                at.iter().map(|_| Complex32::new(numbers.unit() as f32 - 0.5, numbers.unit() as f32 - 0.5)).collect();
            all[0].im = 0.0;
            all
        };
        let (a, b) = (random(), random());
        let value = |c: &[Complex32], x: usize, y: usize| -> f64 {
            let term = |(&(u, v), c): (&(usize, isize), &Complex32)| {
                let turn = std::f64::consts::TAU * (u as f64 * x as f64 + v as f64 * y as f64) / n as f64;
                let twice = if (u, v) == (0, 0) { 1.0 } else { 2.0 };
                twice * (f64::from(c.re) * turn.cos() - f64::from(c.im) * turn.sin())
            };
            at.iter().zip(c).map(term).sum()
        };
        let cells = (0..n).flat_map(|x| (0..n).map(move |y| (x, y)));
        let want: f64 = cells.map(|(x, y)| value(&a, x, y) * value(&b, x, y)).sum::<f64>() / (n * n) as f64;
        assert!((inner(&a, &b) - want).abs() < 1e-5, "{} is not {want}", inner(&a, &b));
        assert_eq!(inner(&[], &[]), 0.0);
    }
}
