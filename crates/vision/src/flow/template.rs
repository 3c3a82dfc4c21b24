use super::kernel::{LANES, Patch, Planes, blend};
use crate::smoothing::reflected;
use multiversion::multiversion;
use pursuit_geometry::Size;
use pursuit_imaging::Image;

/// A window of the first image at a sub-pixel position, with its gradients; scratch, made anew for every point and level.
#[derive(Debug, Clone)]
pub(super) struct Template {
    window: Size,
    stride: usize,
    intensity: Vec<f32>,
    gradient_x: Vec<f32>,
    gradient_y: Vec<f32>,
    inside: Vec<f32>,
    /// The pixels of the window and one more on every side, and one more right and below for interpolation.
    pixels: Vec<u8>,
    /// Two rows of each of intensity, ∂x and ∂y on whole pixels.
    lines: Vec<f32>,
    /// The pixels of the window and one more on every side, at the sub-pixel position.
    blended: Vec<f32>,
    pub mean: f32,
    pub variance: f32,
}

/// The matrix Σ ∇I·∇Iᵀ of a window: xx, xy, yy.
#[derive(Debug, Clone, Copy)]
pub(super) struct GradientMatrix {
    pub xx: f32,
    pub xy: f32,
    pub yy: f32,
}

impl GradientMatrix {
    /// Its smaller eigenvalue.
    pub fn least_eigenvalue(self) -> f32 {
        let Self { xx, xy, yy } = self;
        // Of grey codes: no care for overflow is needed.
        (xx + yy - ((xx - yy) * (xx - yy) + 4.0 * xy * xy).sqrt()) / 2.0
    }

    /// The solution of `self · d = −(x, y)`.
    pub fn solve_negative(self, x: f32, y: f32) -> (f32, f32) {
        let Self { xx, xy, yy } = self;
        let inverse = 1.0 / (xx * yy - xy * xy);
        ((xy * y - yy * x) * inverse, (xy * x - xx * y) * inverse)
    }
}

impl Template {
    pub fn new(window: Size) -> Self {
        // One vector more than the pixels, so that a row of `stride + 1` values can always be read.
        let stride = window.width.next_multiple_of(LANES);
        let plane = vec![0.0; stride * window.height];
        let inside = (0..stride).map(|x| if x < window.width { 1.0 } else { 0.0 }).collect();
        Self {
            window,
            stride,
            gradient_x: plane.clone(),
            gradient_y: plane.clone(),
            intensity: plane,
            inside,
            pixels: vec![0; (stride + LANES + 2) * (window.height + 3)],
            lines: vec![0.0; 6 * (stride + LANES)],
            blended: vec![0.0; (stride + LANES) * (window.height + 2)],
            mean: 0.0,
            variance: 0.0,
        }
    }

    pub fn planes(&self) -> Planes<'_> {
        Planes {
            stride: self.stride,
            intensity: &self.intensity,
            gradient_x: &self.gradient_x,
            gradient_y: &self.gradient_y,
            inside: &self.inside,
        }
    }

    /// Takes the window whose first pixel lies at (`x + across`, `y + down`) of `image` (0 ≤ across, down < 1).
    ///
    /// Gradients are Scharr's, in codes per pixel; beyond the image pixels are reflected and gradients are 0, as in
    /// OpenCV's implementation of Bouguet.
    pub fn take(&mut self, image: &Image<u8>, corner: (isize, isize), across: f32, down: f32) {
        let (height, n) = (self.window.height, self.stride + LANES);
        let (x, y) = (corner.0 - 1, corner.1 - 1);
        let inside = x >= 0 && y >= 0 && x as usize + n < image.width() && y as usize + height + 2 < image.height();
        if inside {
            let pixels = &image.as_slice()[y as usize * image.width() + x as usize..];
            let patch = Patch { pixels, stride: image.width(), across, down };
            blend_all(patch, n, &mut self.blended);
            let planes = [&mut self.intensity, &mut self.gradient_x, &mut self.gradient_y].map(Vec::as_mut_slice);
            derive_blended(&self.blended, n, &self.inside, planes);
        } else {
            self.take_at_border(image, corner, across, down);
        }
    }

    /// As [`take`](Self::take): gradients on whole pixels first, so that those beyond the image can be 0.
    fn take_at_border(&mut self, image: &Image<u8>, (x, y): (isize, isize), across: f32, down: f32) {
        let height = self.window.height;
        // One vector more than a row of the planes, so that all is done in whole vectors.
        let n = self.stride + LANES;
        gather(image, (x - 1, y - 1), Size::new(n + 2, height + 3), n + 2, &mut self.pixels);
        let columns = columns_inside(x, n, image.width());
        for j in 0..=height {
            let rows = [j, j + 1, j + 2].map(|r| &self.pixels[r * (n + 2)..][..n + 2]);
            let half = (j % 2) * 3 * n;
            let (intensity, gradients) = self.lines[half..half + 3 * n].split_at_mut(n);
            let (gx, gy) = gradients.split_at_mut(n);
            let at = y + j as isize;
            if at >= 0 && at < image.height() as isize {
                derive(rows, intensity, gx, gy);
                gx[..columns.0].fill(0.0);
                gy[..columns.0].fill(0.0);
                gx[columns.1..].fill(0.0);
                gy[columns.1..].fill(0.0);
            } else {
                intensity.iter_mut().zip(&rows[1][1..]).for_each(|(i, &p)| *i = f32::from(p));
                gx.fill(0.0);
                gy.fill(0.0);
            }
            if j > 0 {
                let (even, odd) = self.lines.split_at(3 * n);
                let (above, below) = if j % 2 == 1 { (even, odd) } else { (odd, even) };
                let out = (j - 1) * self.stride;
                let planes = [&mut self.intensity, &mut self.gradient_x, &mut self.gradient_y];
                for (plane, (above, below)) in planes.into_iter().zip(above.chunks_exact(n).zip(below.chunks_exact(n)))
                {
                    interpolate(above, below, across, down, &mut plane[out..out + self.stride]);
                }
            }
        }
        self.clear_padding();
    }

    /// Makes the gradients beyond the window's width 0, so that the padding counts in no sum.
    fn clear_padding(&mut self) {
        for plane in [&mut self.gradient_x, &mut self.gradient_y] {
            plane.chunks_exact_mut(self.stride).for_each(|row| row[self.window.width..].fill(0.0));
        }
    }

    /// Removes from the gradients all that a change of gain or bias of the window could explain: what is left is
    /// orthogonal to the window's intensities and to constants, so that the displacement that solves the normal
    /// equations is that of the joint least squares in displacement, gain and bias.
    pub fn disregard_lighting(&mut self) {
        let n = (self.window.width * self.window.height) as f32;
        let rows = |plane: &'_ [f32], f: &dyn Fn(usize, f32) -> f32| -> f32 {
            let (stride, width) = (self.stride, self.window.width);
            plane
                .chunks_exact(stride)
                .enumerate()
                .map(|(j, row)| row[..width].iter().enumerate().map(|(i, &v)| f(j * stride + i, v)).sum::<f32>())
                .sum()
        };
        let mean = rows(&self.intensity, &|_, v| v) / n;
        let variance = rows(&self.intensity, &|_, v| (v - mean) * (v - mean)) / n;
        let parts = [&self.gradient_x, &self.gradient_y].map(|g| {
            let along = rows(g, &|at, v| v * (self.intensity[at] - mean)) / n;
            (rows(g, &|_, v| v) / n, if variance > 0.0 { along / variance } else { 0.0 })
        });
        (self.mean, self.variance) = (mean, variance);
        for (gradient, (constant, along)) in [&mut self.gradient_x, &mut self.gradient_y].into_iter().zip(parts) {
            for (gradient, intensity) in
                gradient.chunks_exact_mut(self.stride).zip(self.intensity.chunks_exact(self.stride))
            {
                for (g, i) in gradient[..self.window.width].iter_mut().zip(intensity) {
                    *g -= constant + along * (i - mean);
                }
            }
        }
    }

    pub fn gradient_matrix(&self) -> GradientMatrix {
        let [xx, xy, yy] = products(&self.gradient_x, &self.gradient_y);
        GradientMatrix { xx, xy, yy }
    }
}

/// Which of `n` columns from `x` on lie in an image of `width`: from, to.
fn columns_inside(x: isize, n: usize, width: usize) -> (usize, usize) {
    let from = x.min(0).unsigned_abs().min(n);
    let to = (width as isize - x).clamp(from as isize, n as isize) as usize;
    (from, to)
}

/// Copies the `size` pixels from (`x`, `y`) on into rows of `stride`, reflected about the border pixels.
pub(super) fn gather(image: &Image<u8>, (x, y): (isize, isize), size: Size, stride: usize, out: &mut [u8]) {
    let inside = x >= 0 && x as usize + size.width <= image.width();
    for (j, out) in out.chunks_exact_mut(stride).take(size.height).enumerate() {
        let row = image.row(reflected(y + j as isize, image.height()));
        if inside {
            out[..size.width].copy_from_slice(&row[x as usize..][..size.width]);
        } else {
            for (i, out) in out[..size.width].iter_mut().enumerate() {
                *out = row[reflected(x + i as isize, image.width())];
            }
        }
    }
}

/// Intensity and Scharr's derivatives (3 10 3 across, −1 0 1 along, over 32) in the middle of three rows.
#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn derive(rows: [&[u8]; 3], intensity: &mut [f32], gx: &mut [f32], gy: &mut [f32]) {
    const NEAR: usize = LANES + 2;
    let outputs = intensity.as_chunks_mut::<LANES>().0.iter_mut().zip(gx.as_chunks_mut::<LANES>().0);
    for (at, ((intensity, gx), gy)) in outputs.zip(gy.as_chunks_mut::<LANES>().0).enumerate() {
        let [a, b, c] = rows.map(|row| row[at * LANES..].first_chunk::<NEAR>());
        let (Some(a), Some(b), Some(c)) = (a, b, c) else { return };
        let [a, b, c] = [a, b, c].map(|row| row.map(i32::from));
        for k in 0..LANES {
            let smooth = |k: usize| 3 * (a[k] + c[k]) + 10 * b[k];
            let step = |k: usize| c[k] - a[k];
            intensity[k] = b[k + 1] as f32;
            gx[k] = (smooth(k + 2) - smooth(k)) as f32 * (1.0 / 32.0);
            gy[k] = (3 * (step(k) + step(k + 2)) + 10 * step(k + 1)) as f32 * (1.0 / 32.0);
        }
    }
}

/// The rows of `patch`, one more than `out` has, at its sub-pixel position; rows of `n` values.
#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn blend_all(patch: Patch<'_>, n: usize, out: &mut [f32]) {
    for column in (0..n).step_by(LANES) {
        let Some(mut above) = blend(patch, 0, column) else { return };
        for (j, row) in out.chunks_exact_mut(n).enumerate() {
            let Some(below) = blend(patch, j + 1, column) else { return };
            let Some(out) = row.get_mut(column..).and_then(|row| row.first_chunk_mut::<LANES>()) else { return };
            for k in 0..LANES {
                out[k] = above[k] + patch.down * (below[k] - above[k]);
            }
            above = below;
        }
    }
}

/// Intensity and Scharr's derivatives of `blended`, whose rows of `n` values begin one row and one column before the
/// window; gradients are 0 beyond the window's width.
#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn derive_blended(blended: &[f32], n: usize, inside: &[f32], [intensity, gx, gy]: [&mut [f32]; 3]) {
    let stride = inside.len();
    let outputs = intensity.chunks_exact_mut(stride).zip(gx.chunks_exact_mut(stride));
    for (j, ((intensity, gx), gy)) in outputs.zip(gy.chunks_exact_mut(stride)).enumerate() {
        let rows = [j, j + 1, j + 2].map(|r| &blended[r * n..(r + 1) * n]);
        let vectors = intensity.as_chunks_mut::<LANES>().0.iter_mut().zip(gx.as_chunks_mut::<LANES>().0);
        let vectors = vectors.zip(gy.as_chunks_mut::<LANES>().0).zip(inside.as_chunks::<LANES>().0);
        for (at, (((intensity, gx), gy), inside)) in vectors.enumerate() {
            let [a, b, c] = rows.map(|row| row[at * LANES..].first_chunk::<{ LANES + 2 }>());
            let (Some(a), Some(b), Some(c)) = (a, b, c) else { return };
            for k in 0..LANES {
                intensity[k] = b[k + 1];
                let (left, right) = (3.0 * (a[k] + c[k]) + 10.0 * b[k], 3.0 * (a[k + 2] + c[k + 2]) + 10.0 * b[k + 2]);
                gx[k] = (right - left) * (inside[k] / 32.0);
                let sides = (c[k] - a[k]) + (c[k + 2] - a[k + 2]);
                gy[k] = (3.0 * sides + 10.0 * (c[k + 1] - a[k + 1])) * (inside[k] / 32.0);
            }
        }
    }
}

#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn interpolate(above: &[f32], below: &[f32], across: f32, down: f32, out: &mut [f32]) {
    const NEAR: usize = LANES + 1;
    for (at, out) in out.as_chunks_mut::<LANES>().0.iter_mut().enumerate() {
        let (above, below) = (above[at * LANES..].first_chunk::<NEAR>(), below[at * LANES..].first_chunk::<NEAR>());
        let (Some(above), Some(below)) = (above, below) else { return };
        for k in 0..LANES {
            let left = above[k] + down * (below[k] - above[k]);
            let right = above[k + 1] + down * (below[k + 1] - above[k + 1]);
            out[k] = left + across * (right - left);
        }
    }
}

#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn products(x: &[f32], y: &[f32]) -> [f32; 3] {
    let mut sums = [[0.0f32; LANES]; 3];
    for (x, y) in x.as_chunks::<LANES>().0.iter().zip(y.as_chunks::<LANES>().0) {
        for k in 0..LANES {
            sums[0][k] += x[k] * x[k];
            sums[1][k] += x[k] * y[k];
            sums[2][k] += y[k] * y[k];
        }
    }
    sums.map(|s| s.iter().sum())
}
