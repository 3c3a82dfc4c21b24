//! The spatial weight w of the filter's energy (danelljan2015, eq. 4), by its few Fourier coefficients.

use super::coefficients::add_scaled;
use super::params::SpatialWeightParams;
use pursuit_vision::fourier::Complex32;
use std::f64::consts::TAU;

/// Most coefficients kept along an axis, beside the mean.
const MOST: usize = 16;

/// w(x, y) = mean + Σ across[m − 1]·2cos(2πmx) + Σ down[m − 1]·2cos(2πmy): a function of x and one of y.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct SpatialWeight {
    mean: f32,
    across: Vec<f32>,
    down: Vec<f32>,
}

impl SpatialWeight {
    /// For a target of `target` patch pixels (width, height) in the middle of a patch of `side` pixels.
    pub(super) fn new(params: &SpatialWeightParams, target: (f64, f64), side: usize) -> Self {
        let samples = side.max(1);
        // Mean and further coefficients of what w grows by along an axis.
        let axis = |width: f64| -> Vec<f64> {
            let growth = |i: usize| {
                let away = i as f64 + 0.5 - 0.5 * samples as f64;
                params.edge * (away / (0.5 * width)).abs().powf(params.power)
            };
            let coefficient = |m: usize| {
                let wave = |i: usize| growth(i) * (TAU * m as f64 * (i as f64 + 0.5) / samples as f64).cos();
                (0..samples).map(wave).sum::<f64>() / samples as f64
            };
            (0..=MOST).map(coefficient).collect()
        };
        let (across, down) = (axis(target.0.max(1.0)), axis(target.1.max(1.0)));
        let mean = params.center + across[0] + down[0];
        let largest = across[1..].iter().chain(&down[1..]).fold(mean, |a, b| a.max(b.abs()));
        let kept = |all: &[f64]| -> Vec<f64> {
            let enough = |v: &f64| v.abs() >= params.sparse_below * largest;
            let last = all[1..].iter().rposition(enough).map_or(0, |k| k + 1);
            all[1..=last].iter().map(|v| if enough(v) { *v } else { 0.0 }).collect()
        };
        let (across, down) = (kept(&across), kept(&down));
        // What was left out lifts or lowers the middle: it is as before.
        let lowest = |kept: &[f64]| {
            let value = |i: usize| {
                let wave = |(m, v): (usize, &f64)| 2.0 * v * (TAU * (m + 1) as f64 * i as f64 / 512.0).cos();
                kept.iter().enumerate().map(wave).sum::<f64>()
            };
            (0..512).map(value).fold(f64::INFINITY, f64::min)
        };
        let mean = params.center - lowest(&across) - lowest(&down);
        let single = |all: Vec<f64>| all.into_iter().map(|v| v as f32).collect();
        Self { mean: mean as f32, across: single(across), down: single(down) }
    }

    /// ∫ w² over one period.
    pub(super) fn energy(&self) -> f64 {
        let squares = |all: &[f32]| all.iter().map(|v| 2.0 * f64::from(*v).powi(2)).sum::<f64>();
        f64::from(self.mean).powi(2) + squares(&self.across) + squares(&self.down)
    }

    /// w at a place.
    #[cfg(test)]
    pub(super) fn value(&self, x: f64, y: f64) -> f64 {
        let wave = |all: &[f32], t: f64| -> f64 {
            (1..).zip(all).map(|(m, w)| 2.0 * f64::from(*w) * (TAU * f64::from(m) * t).cos()).sum()
        };
        f64::from(self.mean) + wave(&self.across, x) + wave(&self.down, y)
    }

    /// The highest order along an axis.
    pub(super) fn reach(&self) -> usize {
        self.across.len().max(self.down.len())
    }
}

/// Adds w·(w·f) to functions of a band: what the derivative of ½‖w·f‖² is. Scratch, made for one band.
#[derive(Debug, Clone)]
pub(super) struct Weighing {
    weight: SpatialWeight,
    /// Where coefficient i stands in a column-by-column grid of both signs.
    places: Vec<usize>,
    /// Where conjugates of coefficients stand that are needed beside: place, coefficient.
    mirrored: Vec<(usize, usize)>,
    order: usize,
    rows: usize,
    f: Vec<Complex32>,
    weighed: Vec<Complex32>,
    column: Vec<Complex32>,
}

impl Weighing {
    /// For the frequencies `at`, those of a band of `order`.
    pub(super) fn new(weight: SpatialWeight, order: usize, at: &[(usize, isize)]) -> Self {
        let reach = weight.reach();
        // The product has `reach` more frequencies, whose product with w again reaches back.
        let (columns, rows) = (order + 3 * reach + 1, 2 * (order + 2 * reach) + 1);
        let place = |u: isize, v: isize| (u + reach as isize) as usize * rows + (v + (rows / 2) as isize) as usize;
        let mut mirrored = Vec::new();
        for (i, &(u, v)) in at.iter().enumerate() {
            if u <= reach && (u, v) != (0, 0) {
                mirrored.push((place(-(u as isize), -v), i));
            }
        }
        let grid = vec![Complex32::default(); columns * rows];
        Self {
            places: at.iter().map(|&(u, v)| place(u as isize, v)).collect(),
            mirrored,
            order,
            rows,
            f: grid.clone(),
            weighed: grid,
            column: vec![Complex32::default(); rows],
            weight,
        }
    }

    /// `out += w·w·f`.
    pub(super) fn add(&mut self, f: &[Complex32], out: &mut [Complex32]) {
        let Self { weight, places, mirrored, order, rows, f: grid, weighed, column } = self;
        let (reach, rows, order) = (weight.reach(), *rows, *order);
        for (place, value) in places.iter().zip(f) {
            grid[*place] = *value;
        }
        for &(place, i) in mirrored.iter() {
            grid[place] = f[i].conj();
        }
        // Columns from 0 on; those before are conjugates, upside down.
        for u in 0..=order + reach {
            let at = (u + reach) * rows;
            product_column(weight, grid, rows, u + reach, column);
            weighed[at..at + rows].copy_from_slice(column);
        }
        for u in 1..=reach {
            let (before, after) = weighed.split_at_mut(reach * rows);
            let from = &after[u * rows..(u + 1) * rows];
            let to = &mut before[(reach - u) * rows..(reach - u + 1) * rows];
            to.iter_mut().zip(from.iter().rev()).for_each(|(to, from)| *to = from.conj());
        }
        let mut known = usize::MAX;
        for (place, out) in places.iter().zip(out) {
            let u = place / rows;
            if u != known {
                product_column(weight, weighed, rows, u, column);
                known = u;
            }
            *out += column[place % rows];
        }
    }
}

/// Column `at` of the product of w with a function whose columns of coefficients are given.
fn product_column(weight: &SpatialWeight, grid: &[Complex32], rows: usize, at: usize, out: &mut [Complex32]) {
    let column = |k: usize| &grid[k * rows..(k + 1) * rows];
    out.fill(Complex32::default());
    add_scaled(out, column(at), weight.mean);
    for (m, &w) in (1..).zip(&weight.across) {
        add_scaled(out, column(at - m), w);
        add_scaled(out, column(at + m), w);
    }
    for (m, &w) in (1..).zip(&weight.down) {
        add_scaled(&mut out[m..], &column(at)[..rows - m], w);
        add_scaled(&mut out[..rows - m], &column(at)[m..], w);
    }
}

#[cfg(test)]
mod tests {
    use super::super::coefficients::frequencies;
    use super::*;
    use pursuit_testkit::SplitMix;

    #[test]
    fn the_weight_is_least_in_the_middle_and_grows() {
        let params = SpatialWeightParams { sparse_below: 0.005, ..SpatialWeightParams::default() };
        for target in [(48.0, 48.0), (20.0, 90.0)] {
            let weight = SpatialWeight::new(&params, target, 192);
            let value = |x: f64, y: f64| weight.value(x, y);
            assert!((value(0.5, 0.5) - params.center).abs() < 1e-6, "{}", value(0.5, 0.5));
            let (edge, corner) = (value(0.5 + 0.5 * target.0 / 192.0, 0.5), value(0.0, 0.0));
            assert!((edge / params.edge - 1.0).abs() < 0.6 && corner > 4.0 * edge, "{target:?}: {edge} {corner}");
            let (n, mut sum) = (64, 0.0);
            for k in 0..n * n {
                sum += value((k % n) as f64 / n as f64, (k / n) as f64 / n as f64).powi(2) / (n * n) as f64;
            }
            assert!((sum / weight.energy() - 1.0).abs() < 1e-4);
        }
    }

    /// By the definition: coefficients of both signs, all products, with nothing cut off in between.
    #[test]
    fn weighing_twice_equals_the_sum_of_products() {
        let (order, mut numbers) = (5, SplitMix::after(7));
        let at = frequencies(&[order]);
        let params = SpatialWeightParams { sparse_below: 0.02, ..SpatialWeightParams::default() };
        let weight = SpatialWeight::new(&params, (20.0, 50.0), 120);
        assert!(weight.across.len() > weight.down.len() && !weight.down.is_empty(), "{weight:?}");
        let mut f: Vec<Complex32> =
            at.iter().map(|_| Complex32::new(numbers.unit() as f32, numbers.unit() as f32)).collect();
        f[0].im = 0.0;
        let n = order as isize + 2 * weight.reach() as isize;
        let side = (2 * n + 1) as usize;
        let index = |u: isize, v: isize| ((u + n) * side as isize + v + n) as usize;
        let mut full = vec![Complex32::default(); side * side];
        for (&(u, v), c) in at.iter().zip(&f) {
            full[index(-(u as isize), -v)] = c.conj();
            full[index(u as isize, v)] = *c;
        }
        let tap = |du: isize, dv: isize| match (du.unsigned_abs(), dv.unsigned_abs()) {
            (0, 0) => weight.mean,
            (m, 0) => weight.across.get(m - 1).copied().unwrap_or(0.0),
            (0, m) => weight.down.get(m - 1).copied().unwrap_or(0.0),
            _ => 0.0,
        };
        let product = |full: &[Complex32]| {
            let mut out = vec![Complex32::default(); side * side];
            for (u, v) in (-n..=n).flat_map(|u| (-n..=n).map(move |v| (u, v))) {
                for (p, q) in (-n..=n).flat_map(|p| (-n..=n).map(move |q| (p, q))) {
                    out[index(u, v)] += full[index(p, q)] * tap(u - p, v - q);
                }
            }
            out
        };
        let want = product(&product(&full));
        let mut weighing = Weighing::new(weight.clone(), order, &at);
        for _ in 0..2 {
            let mut got = vec![Complex32::new(1.0, 0.0); at.len()];
            weighing.add(&f, &mut got);
            for (&(u, v), got) in at.iter().zip(&got) {
                let want = want[index(u as isize, v)] + Complex32::new(1.0, 0.0);
                assert!((got - want).norm() < 1e-5, "({u}, {v}): {got} is not {want}");
            }
        }
    }
}
