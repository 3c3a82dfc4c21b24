use super::highest;
use multiversion::multiversion;

/// How clearly a plane's peak stands out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PeakQuality {
    /// Largest value.
    pub peak: f64,
    /// Peak-to-sidelobe ratio, see [`peak_to_sidelobe_ratio`].
    pub psr: f64,
    /// Average peak-to-correlation energy, see [`average_peak_to_correlation_energy`].
    pub apce: f64,
}

impl PeakQuality {
    /// Of the highest cell of a plane with rows of `width`, all in one pass; `exclude` as for [`peak_to_sidelobe_ratio`].
    pub fn of(plane: &[f32], width: usize, exclude: usize) -> Self {
        let (x, y, peak) = highest(plane, width);
        let whole = moments(plane);
        Self {
            peak: f64::from(peak),
            psr: sidelobe(&whole, plane, width, (x, y), exclude),
            apce: energy(&whole, plane.len()),
        }
    }
}

/// Peak-to-sidelobe ratio (bolme2010, section 3.5): how many standard deviations the peak stands above the mean of the
/// rest, the sidelobe, which leaves out a square of `2·exclude + 1` cells about the peak (the paper: 5, of 64 × 64). The
/// plane has rows of `width` and wraps around. A flat plane, or one without a sidelobe, gives 0.
pub fn peak_to_sidelobe_ratio(plane: &[f32], width: usize, exclude: usize) -> f64 {
    let (px, py, _) = highest(plane, width);
    sidelobe_ratio(plane, width, (px, py), exclude)
}

/// As [`peak_to_sidelobe_ratio`], of the peak in the cell (`px`, `py`).
pub(crate) fn sidelobe_ratio(plane: &[f32], width: usize, peak: (usize, usize), exclude: usize) -> f64 {
    sidelobe(&moments(plane), plane, width, peak, exclude)
}

/// Average peak-to-correlation energy (wang2017, eq. 9): `(max − min)² / mean((value − min)²)`; high for one sharp peak on
/// a flat ground. A flat or empty plane gives 0.
pub fn average_peak_to_correlation_energy(plane: &[f32]) -> f64 {
    energy(&moments(plane), plane.len())
}

/// What is summed over a plane.
#[derive(Debug, Clone, Copy)]
struct Moments {
    sum: f64,
    squares: f64,
    low: f32,
    high: f32,
}

/// Sums that are kept side by side.
const LANES: usize = 8;

#[multiversion(targets("x86_64+avx2+fma", "aarch64+neon"))]
fn moments(plane: &[f32]) -> Moments {
    let (mut sum, mut squares) = ([0.0f64; LANES], [0.0f64; LANES]);
    let (mut low, mut high) = ([f32::INFINITY; LANES], [f32::NEG_INFINITY; LANES]);
    let (whole, rest) = plane.as_chunks::<LANES>();
    for values in whole {
        for k in 0..LANES {
            let value = f64::from(values[k]);
            sum[k] += value;
            squares[k] += value * value;
            low[k] = low[k].min(values[k]);
            high[k] = high[k].max(values[k]);
        }
    }
    for (k, &v) in rest.iter().enumerate() {
        let value = f64::from(v);
        sum[k] += value;
        squares[k] += value * value;
        (low[k], high[k]) = (low[k].min(v), high[k].max(v));
    }
    Moments {
        sum: sum.iter().sum(),
        squares: squares.iter().sum(),
        low: low.iter().copied().fold(f32::INFINITY, f32::min),
        high: high.iter().copied().fold(f32::NEG_INFINITY, f32::max),
    }
}

/// The peak-to-sidelobe ratio of the cell (`px`, `py`): what lies near it is taken off the sums over the `whole`.
fn sidelobe(whole: &Moments, plane: &[f32], width: usize, (px, py): (usize, usize), exclude: usize) -> f64 {
    let Some(&peak) = plane.get(py * width + px) else { return 0.0 };
    let height = plane.len() / width.max(1);
    // The cells near the peak, each once although the plane wraps around.
    let near = |p: usize, n: usize| {
        let side = (2 * exclude + 1).min(n);
        (0..side).map(move |k| (p + n - exclude.min(n) + k) % n)
    };
    let (mut count, mut sum, mut squares) = ((width * height) as f64, whole.sum, whole.squares);
    for y in near(py, height) {
        for x in near(px, width) {
            let value = f64::from(plane[y * width + x]);
            (count, sum, squares) = (count - 1.0, sum - value, squares - value * value);
        }
    }
    if count < 2.0 {
        return 0.0;
    }
    let mean = sum / count;
    let variance = squares / count - mean * mean;
    // A flat plane's variance is what rounding leaves of its square.
    if variance > 1e-14 * mean * mean { (f64::from(peak) - mean) / variance.sqrt() } else { 0.0 }
}

/// The average peak-to-correlation energy of a plane of `count` cells.
fn energy(whole: &Moments, count: usize) -> f64 {
    let (low, count) = (f64::from(whole.low), count.max(1) as f64);
    // Σ (v − low)² = Σ v² − 2 low Σ v + n low².
    let mean = (whole.squares - 2.0 * low * whole.sum) / count + low * low;
    if mean > 0.0 { (f64::from(whole.high) - low).powi(2) / mean } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The ratio by its words: mean and standard deviation of the cells that are not near the peak.
    fn sidelobe_cell_by_cell(plane: &[f32], width: usize, exclude: usize) -> f64 {
        let (px, py, peak) = highest(plane, width);
        let height = plane.len() / width;
        let near = |i: usize, p: usize, n: usize| i.abs_diff(p).min(n - i.abs_diff(p)) <= exclude;
        let rest: Vec<f64> = (0..plane.len())
            .filter(|i| !(near(i % width, px, width) && near(i / width, py, height)))
            .map(|i| f64::from(plane[i]))
            .collect();
        let mean = rest.iter().sum::<f64>() / rest.len() as f64;
        let deviation = (rest.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / rest.len() as f64).sqrt();
        if rest.len() < 2 { 0.0 } else { (f64::from(peak) - mean) / deviation }
    }

    fn energy_cell_by_cell(plane: &[f32]) -> f64 {
        let low = plane.iter().copied().fold(f32::INFINITY, f32::min);
        let high = plane.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let mean = plane.iter().map(|&v| (f64::from(v) - f64::from(low)).powi(2)).sum::<f64>() / plane.len() as f64;
        (f64::from(high) - f64::from(low)).powi(2) / mean
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]
        #[test]
        fn one_pass_equals_cell_by_cell(
            values in proptest::collection::vec(-2.0f32..3.0, 13 * 12),
            width in 1usize..14,
            height in 1usize..13,
            exclude in 0usize..8,
        ) {
            let plane = &values[..width * height];
            let quality = PeakQuality::of(plane, width, exclude);
            let (psr, apce) = (sidelobe_cell_by_cell(plane, width, exclude), energy_cell_by_cell(plane));
            prop_assert_eq!(quality.peak, f64::from(plane.iter().copied().fold(f32::NEG_INFINITY, f32::max)));
            prop_assert!((quality.psr - psr).abs() <= 1e-9 * psr.abs() || !psr.is_finite(), "{} {}", quality.psr, psr);
            prop_assert!((quality.apce - apce).abs() <= 1e-9 * apce || !apce.is_finite(), "{} {}", quality.apce, apce);
            prop_assert_eq!(quality.psr, peak_to_sidelobe_ratio(plane, width, exclude));
            prop_assert_eq!(quality.apce, average_peak_to_correlation_energy(plane));
        }
    }

    #[test]
    fn ratios_of_planes_worked_by_hand() {
        let plane: Vec<f32> = (0..10 * 10).map(|i| if i == 55 { 5.0 } else { (i % 2 * 2) as f32 }).collect();
        let sidelobe: Vec<f64> = (0..100usize)
            .filter(|i| (i % 10).abs_diff(5) > 1 || (i / 10).abs_diff(5) > 1)
            .map(|i| (i % 2 * 2) as f64)
            .collect();
        let mean = sidelobe.iter().sum::<f64>() / sidelobe.len() as f64;
        let deviation = (sidelobe.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / sidelobe.len() as f64).sqrt();
        assert!((peak_to_sidelobe_ratio(&plane, 10, 1) - (5.0 - mean) / deviation).abs() < 1e-9);
        assert!((average_peak_to_correlation_energy(&[0.0, 0.0, 0.0, 2.0]) - 4.0).abs() < 1e-12);
    }

    #[test]
    fn flat_and_empty_planes_have_no_peak() {
        assert_eq!(peak_to_sidelobe_ratio(&[0.3; 35], 7, 1), 0.0);
        assert_eq!(peak_to_sidelobe_ratio(&[], 0, 1), 0.0);
        assert_eq!(average_peak_to_correlation_energy(&[0.3; 35]), 0.0);
        let broken = [f32::NAN, 1.0, 2.0, 0.0];
        assert_eq!((peak_to_sidelobe_ratio(&broken, 2, 0), average_peak_to_correlation_energy(&broken)), (0.0, 0.0));
        assert_eq!(average_peak_to_correlation_energy(&[]), 0.0);
    }
}
