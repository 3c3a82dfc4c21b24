//! The inner loops of Lucas-Kanade: sums over a window whose rows are padded to whole vectors.

use multiversion::multiversion;

/// Values of a window are stored with rows of a multiple of this many values.
pub(super) const LANES: usize = 8;

/// A window of the second image at a sub-pixel position: pixel (x, y) of the window lies between pixels
/// (x, y) … (x + 1, y + 1) of `pixels`, the fractions `across` and `down` of the way.
#[derive(Clone, Copy)]
pub(super) struct Patch<'a> {
    pub pixels: &'a [u8],
    pub stride: usize,
    pub across: f32,
    pub down: f32,
}

/// The planes of the window in the first image; all have rows of `stride` values, zero beyond the window's width.
#[derive(Clone, Copy)]
pub(super) struct Planes<'a> {
    pub stride: usize,
    pub intensity: &'a [f32],
    pub gradient_x: &'a [f32],
    pub gradient_y: &'a [f32],
    /// 1 inside, 0 in the padding, for one row.
    pub inside: &'a [f32],
}

/// Sums over the window; d = second image − first image.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Sums {
    /// Σ d·∂x.
    pub x: f32,
    /// Σ d·∂y.
    pub y: f32,
    /// Σ v, v the second image less `offset`; only where asked for.
    pub value: f32,
    /// Σ v²; only where asked for.
    pub square: f32,
}

/// Σ d·∂x and Σ d·∂y.
#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
pub(super) fn mismatch(patch: Patch<'_>, planes: Planes<'_>, line: &mut [f32]) -> Sums {
    if planes.stride == LANES { narrow_sums(patch, planes) } else { sums::<false>(patch, planes, 0.0, line) }
}

/// All four sums; values are taken less `offset`, so that squares stay small.
#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
pub(super) fn mismatch_and_spread(patch: Patch<'_>, planes: Planes<'_>, offset: f32, line: &mut [f32]) -> Sums {
    sums::<true>(patch, planes, offset, line)
}

/// As [`sums`], to the last bit, of a window whose rows are one vector each: nothing but the pixels is read from memory, and each
/// row of them once.
#[inline(always)]
fn narrow_sums(patch: Patch<'_>, planes: Planes<'_>) -> Sums {
    let (mut x, mut y) = ([0.0f32; LANES], [0.0f32; LANES]);
    let row = |j: usize| patch.pixels.get(j * patch.stride..).and_then(|row| row.first_chunk::<{ LANES + 1 }>());
    let Some(first) = row(0) else { return Sums::default() };
    let (mut top_left, mut top_right) = halves(first);
    let template = planes.intensity.as_chunks::<LANES>().0.iter().zip(planes.gradient_x.as_chunks::<LANES>().0);
    for (j, ((intensity, gx), gy)) in template.zip(planes.gradient_y.as_chunks::<LANES>().0).enumerate() {
        let Some(below) = row(j + 1) else { break };
        let (left, right) = halves(below);
        let mut d = [0.0f32; LANES];
        for k in 0..LANES {
            let l = top_left[k] + patch.down * (left[k] - top_left[k]);
            let r = top_right[k] + patch.down * (right[k] - top_right[k]);
            d[k] = l + patch.across * (r - l) - intensity[k];
        }
        for k in 0..LANES {
            x[k] += d[k] * gx[k];
        }
        for k in 0..LANES {
            y[k] += d[k] * gy[k];
        }
        (top_left, top_right) = (left, right);
    }
    Sums { x: x.iter().sum(), y: y.iter().sum(), ..Sums::default() }
}

/// All but the last, and all but the first, of the pixels of a row.
#[inline(always)]
fn halves(row: &[u8; LANES + 1]) -> ([f32; LANES], [f32; LANES]) {
    let (mut left, mut right) = ([0.0; LANES], [0.0; LANES]);
    for k in 0..LANES {
        left[k] = f32::from(row[k]);
    }
    for k in 0..LANES {
        right[k] = f32::from(row[k + 1]);
    }
    (left, right)
}

#[inline(always)]
fn sums<const SPREAD: bool>(patch: Patch<'_>, planes: Planes<'_>, offset: f32, line: &mut [f32]) -> Sums {
    let n = planes.stride;
    let (mut x, mut y) = ([0.0f32; LANES], [0.0f32; LANES]);
    let (mut value, mut square) = ([0.0f32; LANES], [0.0f32; LANES]);
    let rows = planes.intensity.chunks_exact(n).zip(planes.gradient_x.chunks_exact(n));
    for (j, ((intensity, gx), gy)) in rows.zip(planes.gradient_y.chunks_exact(n)).enumerate() {
        blend_rows(patch, j, n, line);
        // Arrays of a fixed length: the compiler makes one vector of each.
        let vectors = line[..n].as_chunks::<LANES>().0.iter().zip(line[1..n + 1].as_chunks::<LANES>().0);
        let template = intensity.as_chunks::<LANES>().0.iter().zip(gx.as_chunks::<LANES>().0);
        let rest = gy.as_chunks::<LANES>().0.iter().zip(planes.inside.as_chunks::<LANES>().0);
        for (((l, r), (i, gx)), (gy, inside)) in vectors.zip(template).zip(rest) {
            // One short loop for each result: the compiler makes vectors of these, but not of one loop for all.
            let (mut v, mut d) = ([0.0f32; LANES], [0.0f32; LANES]);
            for k in 0..LANES {
                v[k] = l[k] + patch.across * (r[k] - l[k]);
                d[k] = v[k] - i[k];
            }
            for k in 0..LANES {
                x[k] += d[k] * gx[k];
            }
            for k in 0..LANES {
                y[k] += d[k] * gy[k];
            }
            if SPREAD {
                for k in 0..LANES {
                    let v = (v[k] - offset) * inside[k];
                    value[k] += v;
                    square[k] += v * v;
                }
            }
        }
    }
    Sums { x: x.iter().sum(), y: y.iter().sum(), value: value.iter().sum(), square: square.iter().sum() }
}

/// Mean of |d − `bias`| over the window of `width` columns, the second image multiplied by `gain`.
#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
pub(super) fn mean_difference(
    patch: Patch<'_>,
    planes: Planes<'_>,
    width: usize,
    (gain, bias): (f32, f32),
    line: &mut [f32],
) -> f32 {
    let n = planes.stride;
    let mut sum = [0.0f32; LANES];
    for (j, intensity) in planes.intensity.chunks_exact(n).enumerate() {
        blend_rows(patch, j, n, line);
        let vectors = line[..n].as_chunks::<LANES>().0.iter().zip(line[1..n + 1].as_chunks::<LANES>().0);
        let template = intensity.as_chunks::<LANES>().0.iter().zip(planes.inside.as_chunks::<LANES>().0);
        for ((l, r), (i, inside)) in vectors.zip(template) {
            for k in 0..LANES {
                let v = l[k] + patch.across * (r[k] - l[k]);
                sum[k] += (gain * v + bias - i[k]).abs() * inside[k];
            }
        }
    }
    let rows = planes.intensity.len() / n;
    sum.iter().sum::<f32>() / (width * rows) as f32
}

/// Blends rows `j` and `j + 1` of the patch into the first n + 1 values of `line`.
#[inline(always)]
fn blend_rows(patch: Patch<'_>, j: usize, n: usize, line: &mut [f32]) {
    let (top, bottom) = (&patch.pixels[j * patch.stride..][..n + 1], &patch.pixels[(j + 1) * patch.stride..][..n + 1]);
    let blend = |t: u8, b: u8| f32::from(t) + patch.down * (f32::from(b) - f32::from(t));
    let vectors = top.as_chunks::<LANES>().0.iter().zip(bottom.as_chunks::<LANES>().0);
    for (line, (t, b)) in line.as_chunks_mut::<LANES>().0.iter_mut().zip(vectors) {
        for k in 0..LANES {
            line[k] = blend(t[k], b[k]);
        }
    }
    line[n] = blend(top[n], bottom[n]);
}

/// A vector of row `j` of the patch from `column` on, blended across; `None` where the patch ends.
#[inline(always)]
pub(super) fn blend(patch: Patch<'_>, j: usize, column: usize) -> Option<[f32; LANES]> {
    let from = j * patch.stride + column;
    let pixels: &[u8; LANES + 1] = patch.pixels.get(from..from + LANES + 1)?.first_chunk()?;
    let mut out = [0.0; LANES];
    for k in 0..LANES {
        let (left, right) = (f32::from(pixels[k]), f32::from(pixels[k + 1]));
        out[k] = left + patch.across * (right - left);
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vector_windows_equal_the_general_sums() {
        let pixels: Vec<u8> = (0..20 * 20u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
        let plane = |seed: u32| -> Vec<f32> {
            (0..8 * 8u32).map(|i| ((i + seed).wrapping_mul(747_796_405) >> 20) as f32 / 16.0 - 100.0).collect()
        };
        let (intensity, gradient_x, gradient_y) = (plane(1), plane(70), plane(900));
        let planes = Planes {
            stride: LANES,
            intensity: &intensity,
            gradient_x: &gradient_x,
            gradient_y: &gradient_y,
            inside: &[1.0; LANES],
        };
        for (from, across, down) in [(0, 0.0, 0.0), (3, 0.25, 0.7), (45, 0.99, 0.01)] {
            let patch = Patch { pixels: &pixels[from..], stride: 20, across, down };
            assert_eq!(narrow_sums(patch, planes), sums::<false>(patch, planes, 0.0, &mut [0.0; LANES + 1]));
            assert_eq!(mismatch(patch, planes, &mut [0.0; LANES + 1]), narrow_sums(patch, planes));
        }
    }
}
