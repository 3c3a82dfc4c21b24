//! Small patches: taking them at sub-pixel positions, and their normalised cross-correlation.

use multiversion::multiversion;
use pursuit_geometry::{Point, Size};
use pursuit_imaging::ImageView;

/// Takes the patch of `size` pixels centred at `center` (continuous pixels), interpolated bilinearly, the border pixels
/// repeated beyond the image; `out` gets `size.area()` values, row by row, in grey codes.
///
/// A centre that is not finite gives zeros.
pub fn take_patch(image: ImageView<'_, u8>, center: Point, size: Size, out: &mut Vec<f32>) {
    out.clear();
    out.resize(size.area(), 0.0);
    if !(center.x.is_finite() && center.y.is_finite()) || size.area() == 0 {
        return;
    }
    // Of the first pixel's centre, counted from the centre of the image's first pixel; far outside all is border.
    let start = |c: f64, n: usize, side: usize| (c - n as f64 / 2.0).clamp(-(n as f64) - 1.0, side as f64 + 1.0);
    let (left, top) = (start(center.x, size.width, image.width()), start(center.y, size.height, image.height()));
    let (column, row) = (left.floor(), top.floor());
    let (across, down) = ((left - column) as f32, (top - row) as f32);
    let inside = column >= 0.0 && column as usize + size.width < image.width();
    for (j, out) in out.chunks_exact_mut(size.width).enumerate() {
        let line = |k: isize| image.row((row as isize + j as isize + k).clamp(0, image.height() as isize - 1) as usize);
        let (above, below) = (line(0), line(1));
        if inside {
            let from = column as usize;
            blend(&above[from..=from + size.width], &below[from..=from + size.width], across, down, out);
            continue;
        }
        for (i, out) in out.iter_mut().enumerate() {
            let at = |k: isize| (column as isize + i as isize + k).clamp(0, image.width() as isize - 1) as usize;
            let mix = |x: usize| f32::from(above[x]) + down * (f32::from(below[x]) - f32::from(above[x]));
            let (l, r) = (mix(at(0)), mix(at(1)));
            *out = l + across * (r - l);
        }
    }
}

#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn blend(above: &[u8], below: &[u8], across: f32, down: f32, out: &mut [f32]) {
    let n = out.len();
    let (above, below) = (&above[..n + 1], &below[..n + 1]);
    for i in 0..n {
        let mix = |x: usize| f32::from(above[x]) + down * (f32::from(below[x]) - f32::from(above[x]));
        let (l, r) = (mix(i), mix(i + 1));
        out[i] = l + across * (r - l);
    }
}

/// Makes the mean of `patch` 0 and its norm 1, so that [`dot`] of two such patches is their normalised
/// cross-correlation; a patch of one value becomes 0 and `false` is returned.
pub fn normalize(patch: &mut [f32]) -> bool {
    let n = patch.len().max(1) as f32;
    let mean = sum(patch) / n;
    patch.iter_mut().for_each(|v| *v -= mean);
    let norm = dot(patch, patch).sqrt();
    // Rounding of the mean leaves this much of a patch of one value.
    let textured = norm > 1e-5 * (1.0 + mean.abs()) * n.sqrt();
    let factor = if textured { norm.recip() } else { 0.0 };
    patch.iter_mut().for_each(|v| *v *= factor);
    textured
}

/// Σ aᵢ·bᵢ over the shorter of both.
#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
pub fn dot(a: &[f32], b: &[f32]) -> f32 {
    const LANES: usize = 32;
    let n = a.len().min(b.len());
    let (a, b) = (&a[..n], &b[..n]);
    let mut sums = [0.0f32; LANES];
    let ((left, left_rest), (right, right_rest)) = (a.as_chunks::<LANES>(), b.as_chunks::<LANES>());
    for (a, b) in left.iter().zip(right) {
        for k in 0..LANES {
            sums[k] += a[k] * b[k];
        }
    }
    let rest: f32 = left_rest.iter().zip(right_rest).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f32>() + rest
}

fn sum(values: &[f32]) -> f32 {
    values.iter().map(|&v| f64::from(v)).sum::<f64>() as f32
}

/// Normalised cross-correlation (the correlation coefficient) of two patches of equal length, −1 to 1; 0 when either
/// has one value only.
pub fn correlation(a: &[f32], b: &[f32]) -> f32 {
    let n = a.len().min(b.len());
    let (a, b) = (&a[..n], &b[..n]);
    let (mean_a, mean_b) = (sum(a) / n.max(1) as f32, sum(b) / n.max(1) as f32);
    let [ab, aa, bb] = moments(a, b, mean_a, mean_b);
    let least = |mean: f32| 1e-10 * (1.0 + mean.abs()).powi(2) * n as f32;
    if aa > least(mean_a) && bb > least(mean_b) { (ab / (aa * bb).sqrt()).clamp(-1.0, 1.0) } else { 0.0 }
}

#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn moments(a: &[f32], b: &[f32], mean_a: f32, mean_b: f32) -> [f32; 3] {
    const LANES: usize = 8;
    let mut sums = [[0.0f32; LANES]; 3];
    for (a, b) in a.chunks(LANES).zip(b.chunks(LANES)) {
        for (k, (a, b)) in a.iter().zip(b).enumerate() {
            let (a, b) = (a - mean_a, b - mean_b);
            sums[0][k] += a * b;
            sums[1][k] += a * a;
            sums[2][k] += b * b;
        }
    }
    sums.map(|s| s.iter().sum())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use pursuit_imaging::Image;
    use pursuit_testkit::Noise;

    fn noise(w: usize, h: usize, seed: u32) -> Image<u8> {
        let mut noise = Noise::new(seed | 1);
        Image::from_fn(w, h, |_, _| noise.byte()).unwrap()
    }

    /// The slow, obvious twin of the correlation coefficient.
    fn slow(a: &[f32], b: &[f32]) -> f64 {
        let n = a.len() as f64;
        let mean = |v: &[f32]| v.iter().map(|&v| f64::from(v)).sum::<f64>() / n;
        let (ma, mb) = (mean(a), mean(b));
        let sum = |x: &[f32], mx: f64, y: &[f32], my: f64| -> f64 {
            x.iter().zip(y).map(|(&x, &y)| (f64::from(x) - mx) * (f64::from(y) - my)).sum()
        };
        sum(a, ma, b, mb) / (sum(a, ma, a, ma) * sum(b, mb, b, mb)).sqrt()
    }

    proptest! {
        #[test]
        fn patches_are_bilinear(x in -20.0f64..60.0, y in -20.0f64..50.0, (w, h) in (1usize..16, 1usize..16)) {
            let image = noise(40, 30, 7);
            let mut patch = Vec::new();
            take_patch(image.view(), Point::new(x, y), Size::new(w, h), &mut patch);
            prop_assert_eq!(patch.len(), w * h);
            for j in 0..h {
                for i in 0..w {
                    let (px, py) = (x + i as f64 - w as f64 / 2.0, y + j as f64 - h as f64 / 2.0);
                    let (fx, fy) = (px - px.floor(), py - py.floor());
                    let at = |dx: isize, dy: isize| {
                        f64::from(image.view().clamped(px.floor() as isize + dx, py.floor() as isize + dy))
                    };
                    let want = (1.0 - fy) * ((1.0 - fx) * at(0, 0) + fx * at(1, 0)) + fy * ((1.0 - fx) * at(0, 1) + fx * at(1, 1));
                    prop_assert!((f64::from(patch[j * w + i]) - want).abs() < 1e-3, "{} {}", patch[j * w + i], want);
                }
            }
        }

        #[test]
        fn correlation_equals_the_twin(seed in any::<u32>(), n in 2usize..300, gain in 0.1f32..3.0, bias in -50.0f32..50.0) {
            let values: Vec<f32> = noise(n, 2, seed).as_slice().iter().map(|&v| f32::from(v)).collect();
            let (a, b) = values.split_at(n);
            let want = slow(a, b);
            prop_assume!(want.is_finite());
            prop_assert!((f64::from(correlation(a, b)) - want).abs() < 1e-5);
            let (mut x, mut y) = (a.to_vec(), b.to_vec());
            prop_assert!(normalize(&mut x) && normalize(&mut y));
            prop_assert!((f64::from(dot(&x, &y)) - want).abs() < 1e-5);
            prop_assert!((dot(&x, &x) - 1.0).abs() < 1e-5);
            // Gain and bias change nothing.
            let lit: Vec<f32> = a.iter().map(|v| gain * v + bias).collect();
            prop_assert!((correlation(&lit, b) - correlation(a, b)).abs() < 1e-4);
        }
    }

    #[test]
    fn what_has_no_texture_correlates_with_nothing() {
        let flat = [77.7f32; 225];
        let ramp: Vec<f32> = (0u8..225).map(f32::from).collect();
        assert_eq!((correlation(&flat, &ramp), correlation(&ramp, &flat), correlation(&flat, &flat)), (0.0, 0.0, 0.0));
        let mut patch = flat.to_vec();
        assert!(!normalize(&mut patch));
        assert!(patch.iter().all(|&v| v == 0.0));
        assert_eq!(correlation(&ramp, &ramp), 1.0);
        assert_eq!(correlation(&[], &[]), 0.0);
        assert_eq!(dot(&[1.0, 2.0, 3.0], &[4.0, 5.0]), 14.0);
    }

    #[test]
    fn centres_that_are_no_numbers_give_zeros() {
        let mut patch = vec![1.0; 3];
        take_patch(noise(9, 9, 1).view(), Point::new(f64::NAN, 3.0), Size::new(2, 2), &mut patch);
        assert_eq!(patch, [0.0; 4]);
    }
}
