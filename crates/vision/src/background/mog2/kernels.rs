//! Pixels with one or two Gaussians whose heaviest fits, nearly all, in vectors.

use super::state::Row;
use crate::background::mixture::Rule;
use multiversion::multiversion;

/// Updates those pixels of a row whose only Gaussian the value fits, and marks all others in `left_over`.
///
/// The weight of an only Gaussian is 1: before it is divided by itself it is (1 − α) − αc_T + α.
#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
pub(super) fn update_single<const C: usize>(
    line: [&[f32]; C],
    row: &mut Row<'_, C>,
    rule: &Rule,
    left_over: &mut [u8],
) {
    let n = left_over.len();
    let near = rule.match_distance.min(rule.background_distance);
    let rate = rule.rate / (1.0 - rule.prune);
    let (least, most) = (rule.least_variance, rule.most_variance);
    let (counts, variances) = (&row.counts[..n], &mut row.variances[..n]);
    let line = line.map(|l| &l[..n]);
    let means = row.means.each_mut().map(|m| &mut m[..n]);
    for i in 0..n {
        let off: [f32; C] = std::array::from_fn(|c| means[c][i] - line[c][i]);
        let distance = off.iter().fold(0.0, |sum, d| sum + d * d);
        let variance = variances[i];
        let simple = (counts[i] == 1) & (distance < near * variance);
        let k = if simple { rate } else { 0.0 };
        for c in 0..C {
            means[c][i] -= k * off[c];
        }
        let learnt = (variance + k * (distance - variance)).max(least).min(most);
        variances[i] = if simple { learnt } else { variance };
        left_over[i] = u8::from(!simple);
    }
}

/// The same of pixels with one Gaussian or two, whose heavier one the value fits: the lighter one's weight falls, until it
/// is dropped.
#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
pub(super) fn update_pair<const C: usize>(line: [&[f32]; C], row: &mut Row<'_, C>, rule: &Rule, left_over: &mut [u8]) {
    let n = left_over.len();
    let near = rule.match_distance.min(rule.background_distance);
    let (rate, kept, prune) = (rule.rate, 1.0 - rule.rate, rule.prune);
    let only = rate / (1.0 - prune);
    let (least, most) = (rule.least_variance, rule.most_variance);
    let (counts, variances) = (&mut row.counts[..n], &mut row.variances[..n]);
    let (weights, seconds) = (&mut row.weights[..n], &mut row.seconds[..n]);
    let line = line.map(|l| &l[..n]);
    let means = row.means.each_mut().map(|m| &mut m[..n]);
    for i in 0..n {
        let off: [f32; C] = std::array::from_fn(|c| means[c][i] - line[c][i]);
        let distance = off.iter().fold(0.0, |sum, d| sum + d * d);
        let (count, variance) = (counts[i], variances[i]);
        let two = count == 2;
        let fits = ((count == 1) | two) & (distance < near * variance);
        let first = kept * weights[i] - prune + rate;
        let k = if two { rate / first } else { only };
        let k = if fits { k } else { 0.0 };
        for c in 0..C {
            means[c][i] -= k * off[c];
        }
        let learnt = (variance + k * (distance - variance)).max(least).min(most);
        variances[i] = if fits { learnt } else { variance };
        let second = kept * seconds[i] - prune;
        let dropped = second < prune;
        let second = if dropped { 0.0 } else { second };
        let total = first + second;
        let scale = if total.abs() > f32::EPSILON { 1.0 / total } else { 0.0 };
        let pair = fits & two;
        weights[i] = if pair { first * scale } else { weights[i] };
        seconds[i] = if pair { second * scale } else { seconds[i] };
        counts[i] = if pair & dropped { 1 } else { count };
        left_over[i] = u8::from(!fits);
    }
}

/// Channels of interleaved pixels, one after the other. The three are read in one loop, or each would be gathered.
#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
pub(super) fn split_channels<const C: usize>(row: &[u8], line: &mut [f32]) {
    let pixels = row.as_chunks::<C>().0;
    let n = pixels.len();
    let mut planes = line.chunks_exact_mut(n.max(1));
    let planes: [&mut [f32]; C] = std::array::from_fn(|_| planes.next().unwrap_or_default());
    if planes.iter().any(|plane| plane.len() != n) {
        return;
    }
    let planes = planes.map(|plane| &mut plane[..n]);
    for (i, pixel) in pixels.iter().enumerate() {
        for c in 0..C {
            planes[c][i] = f32::from(pixel[c]);
        }
    }
}
