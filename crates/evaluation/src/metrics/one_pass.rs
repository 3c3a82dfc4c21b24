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
