//! One-pass metrics: OTB's success and precision (Wu, Lim, Yang 2013), GOT-10k's average overlap and success rate
//! (Huang, Zhao, Huang 2019), the normalised precision of TrackingNet and LaSOT (Müller et al. 2018).

use super::mean;
use pursuit_geometry::BBox;

/// Overlap thresholds of the success curve: 0, .05, …, 1.
pub const SUCCESS_THRESHOLDS: usize = 21;
/// Centre error thresholds of the precision curve: 0, 1, …, 50 pixels.
pub const PRECISION_THRESHOLDS: usize = 51;
/// Thresholds of the normalised precision curve: 0, .01, …, .5 of the target's size.
pub const NORMALIZED_THRESHOLDS: usize = 51;

/// Overlap (intersection over union) of every pair, in `[0, 1]`.
pub fn overlaps(truth: &[BBox], estimates: &[BBox]) -> Vec<f64> {
    truth.iter().zip(estimates).map(|(t, e)| t.iou(e)).collect()
}

/// Distance of the centres of every pair, in pixels.
pub fn center_errors(truth: &[BBox], estimates: &[BBox]) -> Vec<f64> {
    truth.iter().zip(estimates).map(|(t, e)| t.center().distance(e.center())).collect()
}

/// Distance of the centres, x in units of the true width and y in units of the true height.
pub fn normalized_center_error(truth: &BBox, estimate: &BBox) -> f64 {
    let (t, e) = (truth.center(), estimate.center());
    ((t.x - e.x) / truth.width()).hypot((t.y - e.y) / truth.height())
}

/// Fraction of frames with overlap strictly above `threshold`.
pub fn success_rate(overlaps: &[f64], threshold: f64) -> f64 {
    fraction(overlaps, |o| o > threshold)
}

/// Success rate at 0, .05, …, 1 (strictly above, as in OTB's toolkit).
pub fn success_curve(overlaps: &[f64]) -> [f64; SUCCESS_THRESHOLDS] {
    std::array::from_fn(|i| success_rate(overlaps, i as f64 / (SUCCESS_THRESHOLDS - 1) as f64))
}

/// Area under the success curve, as OTB's toolkit computes it: the mean of its 21 values.
pub fn success_auc(overlaps: &[f64]) -> f64 {
    mean(&success_curve(overlaps))
}

/// Fraction of frames with a centre error of at most `threshold_px`.
pub fn precision(center_errors: &[f64], threshold_px: f64) -> f64 {
    fraction(center_errors, |e| e <= threshold_px)
}

/// Precision at 0, 1, …, 50 pixels.
pub fn precision_curve(center_errors: &[f64]) -> [f64; PRECISION_THRESHOLDS] {
    std::array::from_fn(|px| precision(center_errors, px as f64))
}

/// Fraction of frames with a normalised centre error of at most 0, .01, …, .5.
pub fn normalized_precision_curve(normalized_errors: &[f64]) -> [f64; NORMALIZED_THRESHOLDS] {
    std::array::from_fn(|i| precision(normalized_errors, i as f64 / 100.0))
}

/// Mean overlap (GOT-10k's AO over the frames given).
pub fn average_overlap(overlaps: &[f64]) -> f64 {
    mean(overlaps)
}

fn fraction(values: &[f64], counts: impl Fn(f64) -> bool) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    values.iter().filter(|v| counts(**v)).count() as f64 / values.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn success_is_strict_and_precision_is_not() {
        let overlaps = [0.0, 0.5, 0.55, 1.0];
        assert_eq!([0.0, 0.5, 0.6, 1.0].map(|t| success_rate(&overlaps, t)), [0.75, 0.5, 0.25, 0.0]);
        let errors = [0.0, 20.0, 20.5, f64::INFINITY];
        assert_eq!([0.0, 20.0, 21.0].map(|t| precision(&errors, t)), [0.25, 0.5, 0.75]);
        assert_eq!((success_rate(&[], 0.5), precision(&[], 20.0), average_overlap(&[])), (0.0, 0.0, 0.0));
    }

    #[test]
    fn curves_have_their_thresholds_in_order() {
        let success = success_curve(&[0.5]);
        assert_eq!(success.iter().filter(|v| **v == 1.0).count(), 10, "0, .05, …, .45");
        assert_eq!((success[9], success[10], success[20]), (1.0, 0.0, 0.0));
        assert!((success_auc(&[0.5]) - 10.0 / 21.0).abs() < 1e-12);
        let precision = precision_curve(&[3.0]);
        assert_eq!((precision[2], precision[3], precision[50]), (0.0, 1.0, 1.0));
        let normalized = normalized_precision_curve(&[0.031, 0.5]);
        assert_eq!((normalized[3], normalized[4], normalized[49], normalized[50]), (0.0, 0.5, 0.5, 1.0));
    }

    #[test]
    fn normalised_centre_errors_are_in_target_sizes() {
        let truth = BBox::from_ltwh(10.0, 20.0, 30.0, 50.0);
        let estimate = truth.translated(9.0, -20.0);
        assert!((normalized_center_error(&truth, &estimate) - 0.5).abs() < 1e-12, "hypot(.3, .4)");
        assert!((center_errors(&[truth], &[estimate])[0] - 481f64.sqrt()).abs() < 1e-12);
        assert!((average_overlap(&[0.25, 0.5, 0.9]) - 0.55).abs() < 1e-12);
        let other = truth.translated(15.0, 0.0);
        assert_eq!(overlaps(&[truth, truth], &[truth, other]), [1.0, 1.0 / 3.0]);
    }
}
