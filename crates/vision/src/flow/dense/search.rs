use super::densify::{Found, Sums};
use super::level::Padded;
use super::{DenseFlowParams, Plane};
use multiversion::multiversion;

/// A step shorter than this ends the search of a patch, pixels.
pub(super) const SETTLED_PX: f32 = 0.01;

/// The search of all patches of a level.
pub(super) struct Search<'a> {
    pub params: &'a DenseFlowParams,
    pub first: &'a Padded,
    pub second: &'a Padded,
}

impl Search<'_> {
    /// Searches every patch from where `coarse` leads it, or from where it is, and adds it to `sums`.
    pub fn run(&self, coarse: Option<&Plane>, sums: &mut Sums) {
        search_all(self, coarse, sums);
    }

    /// Left and top of the patches along an axis of `length` pixels: a step apart, the last at the end.
    fn places(&self, length: usize) -> impl Iterator<Item = usize> + use<> {
        let (last, step) = (length - self.params.patch_px, self.params.step());
        (0..last).step_by(step).chain(std::iter::once(last))
    }
}

#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn search_all(search: &Search<'_>, coarse: Option<&Plane>, sums: &mut Sums) {
    match search.params.patch_px {
        8 => each::<8>(search, coarse, sums),
        _ => each::<12>(search, coarse, sums),
    }
}

#[inline(always)]
fn each<const P: usize>(search: &Search<'_>, coarse: Option<&Plane>, sums: &mut Sums) {
    let middle = (P - 1) as f32 / 2.0;
    for top in search.places(search.first.height) {
        for left in search.places(search.first.width) {
            // Pixel x of a level is pixel x/2 of the next, and so are motions.
            let before = coarse.map(|plane| plane.at((left as f32 + middle) / 2.0, (top as f32 + middle) / 2.0));
            let start = before.map_or((0.0, 0.0), |(u, v)| (2.0 * u, 2.0 * v));
            let template = Template::<P>::take(search.first, left, top, search.params);
            let found = template.follow(search.second, start, search.params);
            sums.add(&found);
        }
    }
}

/// A patch of the first picture.
struct Template<const P: usize> {
    left: usize,
    top: usize,
    values: [[f32; P]; P],
    gx: [[f32; P]; P],
    gy: [[f32; P]; P],
    /// Inverse of the matrix of gradients: xx, xy, yy; zeros where there is none.
    inverse: [f32; 3],
    /// Means of the gradients, where patches are compared less their means.
    means: [f32; 2],
}

impl<const P: usize> Template<P> {
    #[inline(always)]
    fn take(first: &Padded, left: usize, top: usize, params: &DenseFlowParams) -> Self {
        let (x, y) = (left as isize, top as isize);
        let (mut values, mut gx, mut gy) = ([[0.0; P]; P], [[0.0; P]; P], [[0.0; P]; P]);
        for j in 0..P {
            let at = y + j as isize;
            let (above, row, below) = (first.from(x, at - 1), first.from(x - 1, at), first.from(x, at + 1));
            let (above, row, below) = (&above[..P], &row[..P + 2], &below[..P]);
            for i in 0..P {
                values[j][i] = f32::from(row[i + 1]);
                gx[j][i] = 0.5 * (f32::from(row[i + 2]) - f32::from(row[i]));
                gy[j][i] = 0.5 * (f32::from(below[i]) - f32::from(above[i]));
            }
        }
        let n = (P * P) as f32;
        let [sum_x, sum_y] = [&gx, &gy].map(|g| lanes::<P>(|j, i| g[j][i]));
        let [xx, xy, yy] = [(&gx, &gx), (&gx, &gy), (&gy, &gy)].map(|(a, b)| lanes::<P>(|j, i| a[j][i] * b[j][i]));
        let means = if params.normalized { [sum_x / n, sum_y / n] } else { [0.0; 2] };
        // Less the means both of patches and of gradients are compared.
        let (xx, xy, yy) = (xx - n * means[0] * means[0], xy - n * means[0] * means[1], yy - n * means[1] * means[1]);
        let more = n * params.damping as f32;
        Self { left, top, values, gx, gy, inverse: inverted(xx + more, xy, yy + more), means }
    }

    /// Where the patch lies in `second`, sought from `start` on: the inverse search of section 2.1. A patch that has gone farther
    /// than its own side from the start goes back to it.
    #[inline(always)]
    fn follow(&self, second: &Padded, start: (f32, f32), params: &DenseFlowParams) -> Found<P> {
        let (mut u, mut v) = start;
        let mut off = self.difference(second, u, v);
        for _ in 0..params.iterations {
            let mut x = lanes::<P>(|j, i| off[j][i] * self.gx[j][i]);
            let mut y = lanes::<P>(|j, i| off[j][i] * self.gy[j][i]);
            if params.normalized {
                let sum = lanes::<P>(|j, i| off[j][i]);
                (x, y) = (x - sum * self.means[0], y - sum * self.means[1]);
            }
            let [xx, xy, yy] = self.inverse;
            let (dx, dy) = (xx * x + xy * y, xy * x + yy * y);
            (u, v) = (u - dx, v - dy);
            off = self.difference(second, u, v);
            if dx * dx + dy * dy < SETTLED_PX * SETTLED_PX {
                break;
            }
        }
        let (du, dv) = (u - start.0, v - start.1);
        // What is no number is not near, and goes back as well.
        let near = du * du + dv * dv <= (P * P) as f32;
        if !near {
            (u, v) = start;
            off = self.difference(second, u, v);
        }
        if params.normalized {
            let mean = lanes::<P>(|j, i| off[j][i]) / (P * P) as f32;
            off.as_flattened_mut().iter_mut().for_each(|d| *d -= mean);
        }
        Found { left: self.left, top: self.top, u, v, off }
    }

    /// The second picture, moved back by (u, v), less the patch.
    #[inline(always)]
    fn difference(&self, second: &Padded, u: f32, v: f32) -> [[f32; P]; P] {
        let place = |at: usize, by: f32, length: usize| (at as f32 + by).clamp(-(P as f32), length as f32);
        let (x, y) = (place(self.left, u, second.width), place(self.top, v, second.height));
        let (column, row) = (x.floor(), y.floor());
        let (across, down) = (x - column, y - row);
        let (column, row) = (column as isize, row as isize);
        let mut off = [[0.0; P]; P];
        let mut above = blended::<P>(second.from(column, row), across);
        for (j, off) in off.iter_mut().enumerate() {
            let below = blended::<P>(second.from(column, row + j as isize + 1), across);
            for i in 0..P {
                off[i] = above[i] + down * (below[i] - above[i]) - self.values[j][i];
            }
            above = below;
        }
        off
    }
}

/// A row between its pixels.
#[inline(always)]
fn blended<const P: usize>(row: &[u8], across: f32) -> [f32; P] {
    let row = &row[..P + 1];
    let mut out = [0.0; P];
    for i in 0..P {
        let (left, right) = (f32::from(row[i]), f32::from(row[i + 1]));
        out[i] = left + across * (right - left);
    }
    out
}

/// The sum over a patch, a sum for each column first: these are vectors.
#[inline(always)]
fn lanes<const P: usize>(value: impl Fn(usize, usize) -> f32) -> f32 {
    let mut sums = [0.0f32; P];
    for j in 0..P {
        for (i, sum) in sums.iter_mut().enumerate() {
            *sum += value(j, i);
        }
    }
    sums.iter().sum()
}

/// The inverse of a symmetric matrix of two rows; zeros where it has none to speak of.
fn inverted(xx: f32, xy: f32, yy: f32) -> [f32; 3] {
    let (determinant, trace) = (xx * yy - xy * xy, xx + yy);
    if determinant > 1e-5 * trace * trace && trace > 0.0 {
        [yy / determinant, -xy / determinant, xx / determinant]
    } else {
        [0.0; 3]
    }
}
