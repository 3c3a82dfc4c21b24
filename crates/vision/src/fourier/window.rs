/// Where the zeros of a Hann window lie. All three are samples of one raised cosine; they differ in what the first and last
/// value are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HannEnds {
    /// On the first and last sample: `½·(1 − cos(2πi / (n−1)))`, as `numpy.hanning`. The outermost cells count nothing.
    Zero,
    /// Half a sample outside: `sin²(π(i+½) / n)`. Symmetric, every cell counts, and the values of a window of `n` are those
    /// of the periodic one taken halfway between its samples.
    HalfSample,
    /// A whole sample outside: `½·(1 − cos(2π(i+1) / (n+1)))`, as `numpy.hanning(n + 2)` without its zeros. What a filter
    /// over a handful of scales needs, of which none may count nothing.
    Positive,
}

/// The Hann window of `n` values; a single value is 1, whatever the ends.
pub fn hann(n: usize, ends: HannEnds) -> Vec<f32> {
    if n <= 1 {
        return vec![1.0; n];
    }
    let (first, length) = first_and_length(n, ends);
    let step = std::f64::consts::TAU / length;
    (0..n).map(|i| (0.5 * (1.0 - (step * (i as f64 + first)).cos())) as f32).collect()
}

/// The outer product of two windows: `height` rows of `width` values, rounded once.
pub fn hann_plane(width: usize, height: usize, ends: HannEnds) -> Vec<f32> {
    let (across, down) = (sines(width, ends), sines(height, ends));
    down.iter().flat_map(|&b| across.iter().map(move |&a| (b * a).powi(2) as f32)).collect()
}

/// The square roots of the Hann window of `n` values.
fn sines(n: usize, ends: HannEnds) -> Vec<f64> {
    if n <= 1 {
        return vec![1.0; n];
    }
    let (first, length) = first_and_length(n, ends);
    let sine = |i: usize| (std::f64::consts::PI * (i as f64 + first) / length).sin();
    // The sine of π is not quite 0 in floating point.
    (0..n).map(sine).map(|s| if s.abs() < 1e-12 { 0.0 } else { s }).collect()
}

/// The window is sin²(π(i + first) / length).
const fn first_and_length(n: usize, ends: HannEnds) -> (f64, f64) {
    match ends {
        HannEnds::Zero => (0.0, (n - 1) as f64),
        HannEnds::HalfSample => (0.5, n as f64),
        HannEnds::Positive => (1.0, (n + 1) as f64),
    }
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
    fn zero_ended_window_equals_numpy() {
        assert_eq!(hann(5, HannEnds::Zero), [0.0, 0.5, 1.0, 0.5, 0.0]);
        let plane = hann_plane(5, 3, HannEnds::Zero);
        assert_eq!(&plane[5..10], hann(5, HannEnds::Zero));
        assert!(plane[..5].iter().all(|&v| v == 0.0));
    }

    #[test]
    fn other_ends_lie_outside_the_samples() {
        let sin2 = |x: f64| (std::f64::consts::PI * x).sin().powi(2) as f32;
        let close = |a: &[f32], b: &[f32]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6);
        assert!(close(&hann(4, HannEnds::HalfSample), &[0.125, 0.375, 0.625, 0.875].map(sin2)));
        assert!(close(&hann(3, HannEnds::Positive), &[0.5, 1.0, 0.5]));
        for n in [2, 3, 8, 33] {
            let padded = hann(n + 2, HannEnds::Zero);
            assert!(close(&hann(n, HannEnds::Positive), &padded[1..=n]), "{n}");
            let twice = hann(2 * n + 1, HannEnds::Zero);
            let odd: Vec<f32> = twice.iter().skip(1).step_by(2).copied().collect();
            assert!(close(&hann(n, HannEnds::HalfSample), &odd), "{n}");
        }
    }

    #[test]
    fn short_windows_are_ones_or_nothing() {
        for ends in [HannEnds::Zero, HannEnds::HalfSample, HannEnds::Positive] {
            assert_eq!((hann(1, ends), hann(0, ends)), (vec![1.0], vec![]));
            assert_eq!(hann_plane(1, 1, ends), [1.0]);
        }
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
