/// The symmetric Hann window `½·(1 − cos(2πi/(n−1)))` of `n` values (as `numpy.hanning`); a single value is 1.
pub fn hann(n: usize) -> Vec<f32> {
    if n <= 1 {
        return vec![1.0; n];
    }
    let step = std::f64::consts::TAU / (n - 1) as f64;
    (0..n).map(|i| (0.5 * (1.0 - (step * i as f64).cos())) as f32).collect()
}

/// The outer product of two windows: `height` rows of `width` values.
pub fn hann_plane(width: usize, height: usize) -> Vec<f32> {
    let (across, down) = (hann(width), hann(height));
    down.iter().flat_map(|&b| across.iter().map(move |&a| a * b)).collect()
}

/// A Gaussian of height 1 and standard deviation `sigma` (in cells) whose peak stands at `(0, 0)` and wraps around the
/// borders: the response that a correlation filter is trained to give on its own patch.
pub fn gaussian_label(width: usize, height: usize, sigma_x: f64, sigma_y: f64) -> Vec<f32> {
    let line = |n: usize, sigma: f64| -> Vec<f64> {
        let wrapped = |i: usize| super::signed_shift(i, n) as f64 / sigma;
        (0..n).map(|i| (-0.5 * wrapped(i).powi(2)).exp()).collect()
    };
    let (across, down) = (line(width, sigma_x), line(height, sigma_y));
    down.iter().flat_map(|&b| across.iter().map(move |&a| (a * b) as f32)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hann_is_that_of_numpy() {
        assert_eq!(hann(5), [0.0, 0.5, 1.0, 0.5, 0.0]);
        assert_eq!(hann(1), [1.0]);
        assert!(hann(0).is_empty());
        let plane = hann_plane(5, 3);
        assert_eq!(&plane[5..10], hann(5));
        assert!(plane[..5].iter().all(|&v| v == 0.0));
    }

    #[test]
    fn the_label_wraps_around() {
        let label = gaussian_label(8, 6, 1.0, 2.0);
        assert_eq!(label[0], 1.0);
        assert_eq!(label[1], label[7]);
        assert_eq!(label[8], label[5 * 8]);
        assert!((label[1] - (-0.5f32).exp()).abs() < 1e-7 && (label[8] - (-0.125f32).exp()).abs() < 1e-7);
    }
}
