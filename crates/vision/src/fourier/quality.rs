use super::highest;

/// Peak-to-sidelobe ratio (bolme2010, section 3.5): how many standard deviations the peak stands above the mean of the
/// rest, the sidelobe, which leaves out a square of `2·exclude + 1` cells about the peak (the paper: 5, of 64 × 64). The
/// plane has rows of `width` and wraps around. A flat plane, or one without a sidelobe, gives 0.
pub fn peak_to_sidelobe_ratio(plane: &[f32], width: usize, exclude: usize) -> f64 {
    let (px, py, _) = highest(plane, width);
    sidelobe_ratio(plane, width, (px, py), exclude)
}

/// As [`peak_to_sidelobe_ratio`], of the peak in the cell (`px`, `py`).
pub(crate) fn sidelobe_ratio(plane: &[f32], width: usize, (px, py): (usize, usize), exclude: usize) -> f64 {
    let Some(&peak) = plane.get(py * width + px) else { return 0.0 };
    let height = plane.len() / width.max(1);
    let near = |i: usize, p: usize, n: usize| {
        let d = i.abs_diff(p);
        d.min(n - d) <= exclude
    };
    let (mut count, mut sum, mut squares) = (0.0, 0.0, 0.0);
    for (y, row) in plane.chunks_exact(width.max(1)).enumerate() {
        let row_near = near(y, py, height);
        for (x, &value) in row.iter().enumerate() {
            if !(row_near && near(x, px, width)) {
                let value = f64::from(value);
                (count, sum, squares) = (count + 1.0, sum + value, squares + value * value);
            }
        }
    }
    if count < 2.0 {
        return 0.0;
    }
    let mean = sum / count;
    let deviation = (squares / count - mean * mean).max(0.0).sqrt();
    if deviation > 0.0 { (f64::from(peak) - mean) / deviation } else { 0.0 }
}

/// Average peak-to-correlation energy (wang2017, eq. 9): `(max − min)² / mean((value − min)²)`; high for one sharp peak on
/// a flat ground. A flat or empty plane gives 0.
pub fn average_peak_to_correlation_energy(plane: &[f32]) -> f64 {
    let low = plane.iter().copied().fold(f32::INFINITY, f32::min);
    let high = plane.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let energy: f64 = plane.iter().map(|&v| f64::from(v - low).powi(2)).sum::<f64>() / plane.len().max(1) as f64;
    if energy > 0.0 { f64::from(high - low).powi(2) / energy } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        assert_eq!(peak_to_sidelobe_ratio(&[1.0; 16], 4, 1), 0.0);
        assert_eq!(peak_to_sidelobe_ratio(&[], 0, 1), 0.0);
        assert_eq!(average_peak_to_correlation_energy(&[1.0; 16]), 0.0);
        assert_eq!(average_peak_to_correlation_energy(&[]), 0.0);
    }
}
