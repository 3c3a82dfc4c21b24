use crate::correlation::ColorParams;
use pursuit_geometry::Size;
use pursuit_parameters::Parameters;
use pursuit_vision::sampling::Planes;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Bits kept of each of red, green and blue (bertinetto2016, section 4.2: 32 bins a channel); the layout of the table.
const BITS: u32 = 5;
/// The number of bins.
const BINS: usize = 1 << (3 * BITS);

/// Histograms of the colours of the target and of its surroundings; says of a pixel how likely it belongs to the target
/// (bertinetto2016, section 3.4: the per-pixel linear regression has the closed form ρ(O) / (ρ(O) + ρ(B))).
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(remote = "ColorHistogram")]
pub struct ColorHistogram {
    target: Vec<f32>,
    surroundings: Vec<f32>,
    /// Half the size of the target in patch pixels.
    half: (f64, f64),
    params: ColorParams,
    #[serde(skip)]
    work: Work,
}

pursuit_estimation::checked!(ColorHistogram);

impl ColorHistogram {
    fn restored(self) -> Result<Self, &'static str> {
        let sane = |v: f64| v.is_finite() && v > 0.0;
        let sound = self.target.len() == BINS
            && self.surroundings.len() == BINS
            && sane(self.half.0)
            && sane(self.half.1)
            && self.params.check_all().is_ok();
        if sound { Ok(self) } else { Err("its colour histograms do not have the right size") }
    }
}

/// What is overwritten at every use.
#[derive(Debug, Clone, Default)]
struct Work {
    target: Vec<f32>,
    surroundings: Vec<f32>,
    /// Sums of the likelihood over all cells above and to the left.
    sums: Vec<f64>,
}

/// Of `n` pixels in a row those whose middles are less than `half` from the middle of all.
fn middle(n: usize, half: f64) -> Range<usize> {
    let first = (0..n).find(|&at| (at as f64 + 0.5 - n as f64 / 2.0).abs() < half).unwrap_or(n / 2);
    // As many are left out on the right as on the left.
    first..(n - first).max(first)
}

#[inline(always)]
fn bin(r: f32, g: f32, b: f32) -> usize {
    // A cast from float saturates, so the bin is always inside.
    let code = |v: f32| usize::from((v + 0.5) as u8 >> (8 - BITS));
    (code(r) << (2 * BITS)) | (code(g) << BITS) | code(b)
}

/// Red, green, blue of a patch; grey counts three times.
fn channels(patch: &Planes) -> [&[f32]; 3] {
    [0, 1, 2].map(|c| patch.plane(c.min(patch.channels() - 1)))
}

impl ColorHistogram {
    /// An untaught model of a target of `width` × `height` patch pixels.
    pub fn new((width, height): (f64, f64), params: ColorParams) -> Self {
        Self {
            target: vec![0.0; BINS],
            surroundings: vec![0.0; BINS],
            half: (width / 2.0, height / 2.0),
            params,
            work: Work::default(),
        }
    }

    /// Its parameters.
    pub const fn params(&self) -> &ColorParams {
        &self.params
    }

    /// Learns the colours of a patch whose centre is the target's: all new at `first`, else blended in.
    pub fn learn(&mut self, patch: &Planes, first: bool) {
        self.blend(patch, if first { 1.0 } else { self.params.learning_rate as f32 });
    }

    fn blend(&mut self, patch: &Planes, rate: f32) {
        let Work { target, surroundings, .. } = &mut self.work;
        target.clear();
        target.resize(BINS, 0.0);
        surroundings.clear();
        surroundings.resize(BINS, 0.0);
        let (Size { width, height }, [r, g, b]) = (patch.size(), channels(patch));
        let share = 1.0 - 2.0 * self.params.inner_margin;
        let (columns, inner_columns) = (middle(width, self.half.0), middle(width, share * self.half.0));
        let (rows, inner_rows) = (middle(height, self.half.1), middle(height, share * self.half.1));
        let none = columns.start..columns.start;
        for y in 0..height {
            let columns = if rows.contains(&y) { &columns } else { &none };
            let inner_columns = if inner_rows.contains(&y) { &inner_columns } else { &none };
            let bin_at = |x: usize| bin(r[y * width + x], g[y * width + x], b[y * width + x]);
            (0..columns.start).chain(columns.end..width).for_each(|x| surroundings[bin_at(x)] += 1.0);
            inner_columns.clone().for_each(|x| target[bin_at(x)] += 1.0);
        }
        let inside = inner_columns.len() * inner_rows.len();
        let outside = width * height - columns.len() * rows.len();
        blend_shares(&mut self.target, target, inside, rate);
        blend_shares(&mut self.surroundings, surroundings, outside, rate);
    }

    /// Blends the mean likelihood of the target's box at every displacement of whole cells into `response`, whose first entry
    /// means no displacement: `(1 − α) f_tmpl + α f_hist` (bertinetto2016, eq. 2).
    pub fn blend_response(&mut self, patch: &Planes, cell_px: usize, grid: Size, response: &mut [f32]) {
        let share = self.params.share as f32;
        response.iter_mut().for_each(|v| *v *= 1.0 - share);
        self.sum_likelihood(patch, cell_px, grid);
        let stride = grid.width + 1;
        // The target's box in cells; corners between cells are interpolated.
        let (half_x, half_y) = (self.half.0 / cell_px as f64, self.half.1 / cell_px as f64);
        let sums = &self.work.sums;
        let sum_at = |x: f64, y: f64| {
            let (x, y) = (x.clamp(0.0, grid.width as f64), y.clamp(0.0, grid.height as f64));
            let (i, j) = ((y as usize).min(grid.height - 1), (x as usize).min(grid.width - 1));
            let (fx, fy) = (x - j as f64, y - i as f64);
            let line = |i: usize| sums[i * stride + j] * (1.0 - fx) + sums[i * stride + j + 1] * fx;
            line(i) * (1.0 - fy) + line(i + 1) * fy
        };
        let scale = f64::from(share) / (4.0 * half_x * half_y).max(1e-9);
        for (k, value) in response.iter_mut().enumerate() {
            let shifted = |k: usize, n: usize| ((k + n / 2) % n) as f64 - (n / 2) as f64 + n as f64 / 2.0;
            let (x, y) = (shifted(k % grid.width, grid.width), shifted(k / grid.width, grid.height));
            let (left, right, top, bottom) = (x - half_x, x + half_x, y - half_y, y + half_y);
            let sum = sum_at(right, bottom) - sum_at(left, bottom) - sum_at(right, top) + sum_at(left, top);
            *value += (scale * sum) as f32;
        }
    }

    /// Mean likelihood of the pixels of the target's box, displaced by `(dx, dy)` patch pixels from the middle of `patch`:
    /// `[0, 1]`, what lies outside of the patch left out; ½ where nothing is left.
    pub fn likelihood(&self, patch: &Planes, (dx, dy): (f64, f64)) -> f64 {
        let (Size { width, height }, [r, g, b]) = (patch.size(), channels(patch));
        let range = |shift: f64, half: f64, n: usize| {
            let middle = n as f64 / 2.0 + shift;
            let clamp = |v: f64| v.round().clamp(0.0, n as f64) as usize;
            clamp(middle - half)..clamp(middle + half)
        };
        let (columns, rows) = (range(dx, self.half.0, width), range(dy, self.half.1, height));
        let prior = self.params.prior as f32;
        let (mut sum, count) = (0.0, columns.len() * rows.len());
        for y in rows {
            let line = y * width + columns.start..y * width + columns.end;
            for ((&r, &g), &b) in r[line.clone()].iter().zip(&g[line.clone()]).zip(&b[line]) {
                let bin = bin(r, g, b);
                let (target, rest) = (self.target[bin] + prior, self.surroundings[bin] + prior);
                sum += f64::from(target / (target + rest));
            }
        }
        if count > 0 { sum / count as f64 } else { 0.5 }
    }

    /// The sums over cells of the mean likelihood of their pixels.
    fn sum_likelihood(&mut self, patch: &Planes, cell_px: usize, grid: Size) {
        let (width, [r, g, b]) = (patch.size().width, channels(patch));
        let (stride, prior) = (grid.width + 1, self.params.prior as f32);
        let sums = &mut self.work.sums;
        sums.clear();
        sums.resize(stride * (grid.height + 1), 0.0);
        let share = 1.0 / (cell_px * cell_px) as f32;
        for cy in 0..grid.height {
            let mut row = 0.0;
            for cx in 0..grid.width {
                let mut cell = 0.0;
                for y in cy * cell_px..(cy + 1) * cell_px {
                    let line = y * width + cx * cell_px..y * width + (cx + 1) * cell_px;
                    for ((&r, &g), &b) in r[line.clone()].iter().zip(&g[line.clone()]).zip(&b[line]) {
                        let bin = bin(r, g, b);
                        let (target, rest) = (self.target[bin] + prior, self.surroundings[bin] + prior);
                        cell += target / (target + rest);
                    }
                }
                row += f64::from(cell * share);
                sums[(cy + 1) * stride + cx + 1] = sums[cy * stride + cx + 1] + row;
            }
        }
    }
}

/// `shares += rate · (counts / total − shares)`; nothing without counts.
fn blend_shares(shares: &mut [f32], counts: &[f32], total: usize, rate: f32) {
    if total > 0 {
        let scale = 1.0 / total as f32;
        shares.iter_mut().zip(counts).for_each(|(s, c)| *s += rate * (c * scale - *s));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A red square of 16 pixels at (left, top) of a blue patch of 40 × 32.
    fn scene(left: usize, top: usize) -> Planes {
        let mut patch = Planes::new(Size::new(40, 32), 3);
        for i in 0..40 * 32 {
            let inside = (left..left + 16).contains(&(i % 40)) && (top..top + 16).contains(&(i / 40));
            patch.plane_mut(0)[i] = if inside { 200.0 } else { 10.0 };
            patch.plane_mut(2)[i] = if inside { 10.0 } else { 200.0 };
        }
        patch
    }

    #[test]
    fn the_box_of_the_targets_color_answers_most() {
        let mut model = ColorHistogram::new((16.0, 16.0), ColorParams { share: 1.0, ..ColorParams::default() });
        model.learn(&scene(12, 8), true);
        let grid = Size::new(10, 8);
        for (dx, dy) in [(0, 0), (2, 1), (-3, -2), (3, 2)] {
            let mut response = vec![0.0; grid.area()];
            let moved = scene((12 + 4 * dx) as usize, (8 + 4 * dy) as usize);
            model.blend_response(&moved, 4, grid, &mut response);
            let best = (0..response.len()).max_by(|a, b| response[*a].total_cmp(&response[*b])).unwrap();
            let want = (dy + 8) as usize % 8 * 10 + (dx + 10) as usize % 10;
            assert_eq!(best, want, "{dx} {dy}: {response:?}");
            assert!(response[best] > 0.95 && response[best] <= 1.001);
        }
    }

    #[test]
    fn likelihood_is_higher_on_the_target_than_beside() {
        let mut model = ColorHistogram::new((16.0, 16.0), ColorParams::default());
        model.learn(&scene(12, 8), true);
        assert!(model.likelihood(&scene(20, 4), (8.0, -4.0)) > 0.99);
        assert!(model.likelihood(&scene(20, 4), (-8.0, 0.0)) < 0.01);
        assert_eq!(model.likelihood(&scene(20, 4), (400.0, 0.0)), 0.5);
    }

    #[test]
    fn likelihood_is_that_of_the_histograms() {
        let params = ColorParams { inner_margin: 0.0, learning_rate: 0.5, ..ColorParams::default() };
        let mut model = ColorHistogram::new((16.0, 16.0), params);
        model.learn(&scene(12, 8), true);
        let (red, blue) = (bin(200.0, 0.0, 10.0), bin(10.0, 0.0, 200.0));
        assert!((model.target[red] - 1.0).abs() < 1e-6 && (model.surroundings[blue] - 1.0).abs() < 1e-6);
        model.learn(&scene(20, 8), false);
        assert!((model.target[red] - 0.75).abs() < 1e-6, "{}", model.target[red]);
    }

    #[test]
    fn the_response_is_blended_by_its_share() {
        let mut model = ColorHistogram::new((16.0, 16.0), ColorParams { share: 0.25, ..ColorParams::default() });
        model.learn(&scene(12, 8), true);
        let mut response = vec![2.0; 80];
        model.blend_response(&scene(12, 8), 4, Size::new(10, 8), &mut response);
        // The filter's part is 3/4 of 2; on the target the colours add 1/4.
        assert!((response[0] - 1.75).abs() < 1e-3, "{}", response[0]);
        assert!((response[4 * 10 + 5] - 1.5).abs() < 0.02, "{}", response[45]);
    }

    #[test]
    fn states_that_do_not_fit_are_refused() {
        let mut model = ColorHistogram::new((16.0, 12.0), ColorParams::default());
        let back = |m: &ColorHistogram| postcard::from_bytes::<ColorHistogram>(&postcard::to_stdvec(m).unwrap());
        assert_eq!(back(&model).unwrap().half, (8.0, 6.0));
        model.target.pop();
        assert!(back(&model).is_err());
        let endless = ColorHistogram::new((f64::INFINITY, 1.0), ColorParams::default());
        assert!(back(&endless).is_err());
    }
}
