//! Pixels with a single Gaussian, nearly all, in vectors.

use multiversion::multiversion;

/// Squared distance that is near (in variances), share of the frame, least and greatest variance.
pub(super) type Limits = (f32, f32, f32, f32);

#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
pub(super) fn update_gray(
    line: &[f32],
    counts: &[u8],
    variances: &mut [f32],
    means: &mut [f32],
    (near, k, least, most): Limits,
    left_over: &mut [u8],
) {
    let n = left_over.len();
    let (line, counts, variances, means) = (&line[..n], &counts[..n], &mut variances[..n], &mut means[..n]);
    for i in 0..n {
        let off = means[i] - line[i];
        let variance = variances[i];
        let simple = (counts[i] == 1) & (off * off < near * variance);
        let k = if simple { k } else { 0.0 };
        means[i] -= k * off;
        let learnt = (variance + k * (off * off - variance)).max(least).min(most);
        variances[i] = if simple { learnt } else { variance };
        left_over[i] = u8::from(!simple);
    }
}

#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
pub(super) fn update_color(
    line: [&[f32]; 3],
    counts: &[u8],
    variances: &mut [f32],
    means: [&mut [f32]; 3],
    (near, k, least, most): Limits,
    left_over: &mut [u8],
) {
    let n = left_over.len();
    let [red, green, blue] = line.map(|l| &l[..n]);
    let [mean_red, mean_green, mean_blue] = means.map(|m| &mut m[..n]);
    let (counts, variances) = (&counts[..n], &mut variances[..n]);
    for i in 0..n {
        let (r, g, b) = (mean_red[i] - red[i], mean_green[i] - green[i], mean_blue[i] - blue[i]);
        let distance = r * r + g * g + b * b;
        let variance = variances[i];
        let simple = (counts[i] == 1) & (distance < near * variance);
        let k = if simple { k } else { 0.0 };
        mean_red[i] -= k * r;
        mean_green[i] -= k * g;
        mean_blue[i] -= k * b;
        let learnt = (variance + k * (distance - variance)).max(least).min(most);
        variances[i] = if simple { learnt } else { variance };
        left_over[i] = u8::from(!simple);
    }
}

#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
pub(super) fn split_channels<const C: usize>(row: &[u8], line: &mut [f32]) {
    let width = row.len() / C;
    for (c, out) in line.chunks_exact_mut(width).enumerate().take(C) {
        for (out, v) in out.iter_mut().zip(row.chunks_exact(C)) {
            *out = f32::from(v[c]);
        }
    }
}
