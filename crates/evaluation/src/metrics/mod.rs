//! Metrics: pure functions of overlaps, centre errors, scores and states. Nothing here knows of files or trackers.

pub mod calibration;
pub mod long_term;
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
