//! Metrics: pure functions of overlaps, centre errors, scores and states. Nothing here knows of files or trackers.
//!
//! ```
//! use pursuit_evaluation::metrics::{one_pass, quantile};
//! use pursuit_geometry::BBox;
//!
//! let truth = [0.0, 10.0, 20.0].map(|x| BBox::from_ltwh(x, 0.0, 40.0, 40.0));
//! let estimates = [0.0, 10.0, 60.0].map(|x| BBox::from_ltwh(x, 0.0, 40.0, 40.0));
//! let overlaps = one_pass::overlaps(&truth, &estimates);
//! assert_eq!(overlaps, [1.0, 1.0, 0.0]);
//! assert_eq!(one_pass::success_rate(&overlaps, 0.5), 2.0 / 3.0);
//! assert_eq!(quantile(&one_pass::center_errors(&truth, &estimates), 0.75), Some(20.0));
//! ```

pub mod accuracy;
pub mod calibration;
pub mod long_term;
pub mod many;
pub mod masks;
pub mod one_pass;
pub mod princeton;
pub mod supervised;

/// The arithmetic mean; 0 of nothing.
pub fn mean(values: &[f64]) -> f64 {
    if values.is_empty() { 0.0 } else { values.iter().sum::<f64>() / values.len() as f64 }
}

/// The median (mean of the middle two); `None` of nothing.
pub fn median(values: &[f64]) -> Option<f64> {
    quantile(values, 0.5)
}

/// The quantile `q` in `[0, 1]`, linear between order statistics; `None` of nothing.
pub fn quantile(values: &[f64], q: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().checked_sub(1)?;
    let position = q.clamp(0.0, 1.0) * last as f64;
    let (below, above) = (sorted.get(position.floor() as usize)?, sorted.get(position.ceil() as usize)?);
    let part = position.fract();
    // Infinite errors (lost frames) must not turn into NaN.
    Some(if below == above || part == 0.0 { *below } else { below + (above - below) * part })
}

/// The geometric mean of positive values; `None` of nothing.
pub fn geometric_mean(values: &[f64]) -> Option<f64> {
    let logs: Vec<f64> = values.iter().map(|v| v.ln()).collect();
    (!logs.is_empty()).then(|| mean(&logs).exp())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_are_sums_over_counts() {
        assert_eq!(mean(&[]), 0.0);
        assert_eq!(mean(&[1.0, 2.0, 6.0]), 3.0);
        assert_eq!(mean(&[-4.0]), -4.0);
    }

    #[test]
    fn quantiles_are_linear_between_order_statistics() {
        let values = [30.0, 0.0, 20.0, 10.0]; // in no order
        for (q, expected) in [(0.0, 0.0), (0.25, 7.5), (0.5, 15.0), (0.9, 27.0), (1.0, 30.0), (-1.0, 0.0), (7.0, 30.0)]
        {
            let found = quantile(&values, q).unwrap();
            assert!((found - expected).abs() < 1e-12, "{q}: {found}");
        }
        assert_eq!((quantile(&[], 0.5), quantile(&[4.0], 0.3)), (None, Some(4.0)));
    }

    #[test]
    fn infinite_errors_stay_infinite_and_never_become_nan() {
        let infinite = f64::INFINITY;
        assert_eq!(quantile(&[1.0, infinite, infinite], 0.5), Some(infinite));
        assert_eq!(quantile(&[1.0, 2.0, infinite], 0.5), Some(2.0), "exactly at an order statistic");
        assert_eq!(quantile(&[1.0, infinite, infinite, infinite], 0.5), Some(infinite));
        assert_eq!(quantile(&[1.0, infinite], 0.5), Some(infinite));
    }

    #[test]
    fn medians_are_the_middle() {
        assert_eq!(median(&[5.0, 1.0, 3.0]), Some(3.0));
        assert_eq!(median(&[5.0, 1.0, 3.0, 4.0]), Some(3.5));
        assert_eq!(median(&[]), None);
    }

    #[test]
    fn the_geometric_mean_multiplies() {
        assert!((geometric_mean(&[2.0, 8.0, 4.0]).unwrap() - 4.0).abs() < 1e-12);
        assert!((geometric_mean(&[0.25, 1.0]).unwrap() - 0.5).abs() < 1e-12);
        assert_eq!(geometric_mean(&[]), None);
    }
}
