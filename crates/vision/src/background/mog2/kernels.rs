//! Pixels whose heaviest Gaussian the value fits, nearly all, in vectors.

use super::state::Row;
use crate::background::mixture::Rule;
use multiversion::multiversion;

/// Pixels that are done together: what lies between the loops of [`update_several`] stays near.
pub(super) const STRETCH: usize = 64;

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

/// The same of pixels with any number of Gaussians, at most [`STRETCH`] of them, whose heaviest the value fits: the others
/// lose weight, and the lightest are dropped. Nothing is learnt where `held` is not 0.
#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
pub(super) fn update_several<const C: usize>(
    line: [&[f32]; C],
    row: &mut Row<'_, C>,
    weights: &mut [&mut [f32]],
    rule: &Rule,
    held: &[u8],
    left_over: &mut [u8],
) {
    let n = left_over.len().min(STRETCH);
    let (kept, prune) = (1.0 - rule.rate, rule.prune);
    let Some((heaviest, others)) = weights.split_first_mut() else { return };
    let (mut firsts, mut totals, mut scales) = ([0.0_f32; STRETCH], [0.0_f32; STRETCH], [1.0_f32; STRETCH]);
    let (firsts, totals, scales) = (&mut firsts[..n], &mut totals[..n], &mut scales[..n]);
    let heaviest = &mut heaviest[..n];
    // As many as there are where it learns, 0 elsewhere: then nothing below applies.
    let mut learning = [0_u8; STRETCH];
    let learning = &mut learning[..n];
    let left_over = &mut left_over[..n];
    learn_first::<C>(line, row, (heaviest, firsts), rule, held, left_over);
    let counts = &mut row.counts[..n];
    for i in 0..n {
        learning[i] = if (left_over[i] == 0) & (counts[i] > 1) { counts[i] } else { 0 };
        totals[i] = firsts[i];
    }
    for (k, lighter) in (1_u8..).zip(others.iter_mut()) {
        let lighter = &mut lighter[..n];
        for i in 0..n {
            let active = k < learning[i];
            let weight = kept * lighter[i] - prune;
            let dropped = weight < prune;
            let weight = if dropped { 0.0 } else { weight };
            lighter[i] = if active { weight } else { lighter[i] };
            totals[i] += if active { weight } else { 0.0 };
            learning[i] -= u8::from(active & dropped);
        }
    }
    for i in 0..n {
        let scale = if totals[i].abs() > f32::EPSILON { 1.0 / totals[i] } else { 0.0 };
        scales[i] = scale;
        heaviest[i] = if learning[i] > 0 { firsts[i] * scale } else { heaviest[i] };
        counts[i] = if learning[i] > 0 { learning[i] } else { counts[i] };
    }
    for (k, lighter) in (1_u8..).zip(others.iter_mut()) {
        let lighter = &mut lighter[..n];
        for i in 0..n {
            lighter[i] = if k < learning[i] { lighter[i] * scales[i] } else { lighter[i] };
        }
    }
}

/// The heaviest Gaussians of [`update_several`]: mean and variance; `firsts` becomes the weight that they grow to.
#[inline(always)]
fn learn_first<const C: usize>(
    line: [&[f32]; C],
    row: &mut Row<'_, C>,
    (heaviest, firsts): (&[f32], &mut [f32]),
    rule: &Rule,
    held: &[u8],
    left_over: &mut [u8],
) {
    let n = left_over.len();
    let near = rule.match_distance.min(rule.background_distance);
    let (rate, kept, prune) = (rule.rate, 1.0 - rule.rate, rule.prune);
    let only = rate / (1.0 - prune);
    let (least, most) = (rule.least_variance, rule.most_variance);
    let (counts, variances) = (&row.counts[..n], &mut row.variances[..n]);
    let (heaviest, firsts, held) = (&heaviest[..n], &mut firsts[..n], &held[..n]);
    let line = line.map(|l| &l[..n]);
    let means = row.means.each_mut().map(|m| &mut m[..n]);
    for i in 0..n {
        let off: [f32; C] = std::array::from_fn(|c| means[c][i] - line[c][i]);
        let distance = off.iter().fold(0.0, |sum, d| sum + d * d);
        let variance = variances[i];
        let fits = (held[i] == 0) & (counts[i] > 0) & (distance < near * variance);
        let first = kept * heaviest[i] - prune + rate;
        firsts[i] = first;
        let k = if counts[i] == 1 { only } else { rate / first };
        let k = if fits { k } else { 0.0 };
        for c in 0..C {
            means[c][i] -= k * off[c];
        }
        let learnt = (variance + k * (distance - variance)).max(least).min(most);
        variances[i] = if fits { learnt } else { variance };
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

/// Values of channels, each from 0 to 255, rounded and interleaved. They are rounded plane by plane, in vectors.
#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
pub(super) fn join_channels<const C: usize>(planes: [&[f32]; C], out: &mut [u8]) {
    let mut codes = [[0_u8; STRETCH]; C];
    for (k, pixels) in out.as_chunks_mut::<C>().0.chunks_mut(STRETCH).enumerate() {
        for (codes, plane) in codes.iter_mut().zip(planes) {
            let values = plane.get(k * STRETCH..).unwrap_or_default();
            codes.iter_mut().zip(values).for_each(|(code, v)| *code = (v + 0.5) as i32 as u8);
        }
        for (i, pixel) in pixels.iter_mut().enumerate() {
            for c in 0..C {
                pixel[c] = codes[c][i];
            }
        }
    }
}
