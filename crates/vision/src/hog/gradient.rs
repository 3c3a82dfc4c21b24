//! Gradient length and nearest of 18 orientations for one row of pixels, without lookup or division.

use multiversion::multiversion;

/// Tangents of 10°, 30°, 50°, 70°: where the nearest orientation changes within the first quadrant.
const BORDERS: [f32; 4] = [0.176_326_98, 0.577_350_26, 1.191_753_6, 2.747_477_4];

/// One row of a grey patch: `[above, this, below]` row of equal length ≥ 1.
pub(super) fn gray(rows: [&[f32]; 3], magnitude: &mut [f32], orientation: &mut [u32]) {
    gray_interior(rows, magnitude, orientation);
    ends([rows], magnitude, orientation);
}

/// One row of a colour patch: `[above, this, below]` row of each channel.
pub(super) fn color(rows: [[&[f32]; 3]; 3], magnitude: &mut [f32], orientation: &mut [u32]) {
    color_interior(rows, magnitude, orientation);
    ends(rows, magnitude, orientation);
}

/// First and last pixel, where one neighbour is the pixel itself.
fn ends<const N: usize>(rows: [[&[f32]; 3]; N], magnitude: &mut [f32], orientation: &mut [u32]) {
    let width = magnitude.len();
    for x in [0, width - 1] {
        let (left, right) = (x.saturating_sub(1), (x + 1).min(width - 1));
        let (mut best, mut gradient) = (-1.0, (0.0, 0.0));
        for [above, row, below] in rows {
            let (dx, dy) = (row[right] - row[left], below[x] - above[x]);
            if dx * dx + dy * dy > best {
                (best, gradient) = (dx * dx + dy * dy, (dx, dy));
            }
        }
        (magnitude[x], orientation[x]) = (best.sqrt(), quantized(gradient.0, gradient.1));
    }
}

/// Index of the orientation nearest to (dx, dy) among 0°, 20° … 340°.
///
/// A gradient with dy < 0 is turned by 180° first (9 orientations); then the angle to the x axis is compared with the
/// borders between orientations, and mirrored if dx < 0.
#[inline(always)]
fn quantized(dx: f32, dy: f32) -> u32 {
    let turned = dy < 0.0;
    let (dx, dy) = if turned { (-dx, -dy) } else { (dx, dy) };
    let across = dx.abs();
    let steps = u32::from(dy > BORDERS[0] * across)
        + u32::from(dy > BORDERS[1] * across)
        + u32::from(dy > BORDERS[2] * across)
        + u32::from(dy > BORDERS[3] * across);
    let half = if dx < 0.0 { 9 - steps } else { steps };
    let full = if turned { half + 9 } else { half };
    if full >= 18 { full - 18 } else { full }
}

#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn gray_interior([above, row, below]: [&[f32]; 3], magnitude: &mut [f32], orientation: &mut [u32]) {
    let n = row.len().saturating_sub(2);
    if n == 0 {
        return;
    }
    let (left, right, above, below) = (&row[..n], &row[2..][..n], &above[1..][..n], &below[1..][..n]);
    let (magnitude, orientation) = (&mut magnitude[1..][..n], &mut orientation[1..][..n]);
    for x in 0..n {
        let (dx, dy) = (right[x] - left[x], below[x] - above[x]);
        magnitude[x] = (dx * dx + dy * dy).sqrt();
        orientation[x] = quantized(dx, dy);
    }
}

#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn color_interior([red, green, blue]: [[&[f32]; 3]; 3], magnitude: &mut [f32], orientation: &mut [u32]) {
    let n = magnitude.len().saturating_sub(2);
    if n == 0 {
        return;
    }
    // Slices of one length, so that the loop below is free of bounds checks.
    let (rl, rr, ra, rb) = (&red[1][..n], &red[1][2..][..n], &red[0][1..][..n], &red[2][1..][..n]);
    let (gl, gr, ga, gb) = (&green[1][..n], &green[1][2..][..n], &green[0][1..][..n], &green[2][1..][..n]);
    let (bl, br, ba, bb) = (&blue[1][..n], &blue[1][2..][..n], &blue[0][1..][..n], &blue[2][1..][..n]);
    let (magnitude, orientation) = (&mut magnitude[1..][..n], &mut orientation[1..][..n]);
    for x in 0..n {
        let (mut dx, mut dy) = (rr[x] - rl[x], rb[x] - ra[x]);
        let mut best = dx * dx + dy * dy;
        for (left, right, above, below) in [(gl, gr, ga, gb), (bl, br, ba, bb)] {
            let (cx, cy) = (right[x] - left[x], below[x] - above[x]);
            let square = cx * cx + cy * cy;
            let larger = square > best;
            best = if larger { square } else { best };
            dx = if larger { cx } else { dx };
            dy = if larger { cy } else { dy };
        }
        magnitude[x] = best.sqrt();
        orientation[x] = quantized(dx, dy);
    }
}
