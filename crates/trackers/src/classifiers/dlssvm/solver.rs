//! Dual coordinate descent (ning2016, section 3.2). The dual is
//!
//! ```text
//! max over α ≥ 0 of  Σ Δᵢ(y) αᵢʸ − ½ ‖w‖²,   w = Σ αᵢʸ Ψᵢ(y),   Σ over y of αᵢʸ ≤ C for each frame i
//! ```
//!
//! and in one variable it is a parabola whose top, clipped to what the constraints allow, is the step.

use super::super::canvas::{Canvas, LANES, Place, Shape};
use super::super::haar::below;
use super::maps::{Grid, bits, expand, rate_pattern};
use super::{Derived, Dlssvm, Scratch, Vector};
use multiversion::multiversion;
use pursuit_vision::patch::dot;

/// A window is worth a support vector where it breaks its constraint by more than this.
const TOLERANCE: f64 = 1e-3;

impl Derived {
    pub fn new(grid: Grid, capacity: usize) -> Self {
        Self {
            rows: Vec::with_capacity(capacity * grid.features()),
            kernel: vec![0.0; capacity * capacity],
            weights: vec![0.0; grid.features()],
            is_current: true,
            grid,
        }
    }

    fn row(&self, k: usize) -> &[f32] {
        let n = self.grid.features();
        &self.rows[k * n..(k + 1) * n]
    }

    /// What inner products of bits are multiplied by, so that no window's features are longer than one.
    fn unit(&self) -> f64 {
        1.0 / self.grid.features() as f64
    }

    fn capacity(&self) -> usize {
        self.kernel.len().isqrt()
    }

    /// Ψ · Ψ' of two support vectors.
    pub fn k(&self, a: usize, b: usize) -> f64 {
        self.kernel[a * self.capacity() + b]
    }

    /// Makes w that of today's dual variables.
    pub fn weigh(&mut self, vectors: &[Vector]) {
        if std::mem::replace(&mut self.is_current, true) {
            return;
        }
        self.weights.fill(0.0);
        let (n, unit) = (self.grid.features(), self.unit());
        for (row, v) in self.rows.chunks_exact(n).zip(vectors) {
            add_scaled(row, (unit * v.weight) as f32, &mut self.weights);
        }
    }

    /// Adds the row and the inner products of the support vector that comes next.
    fn push(&mut self, row: &[f32]) {
        let (new, capacity, unit) = (self.rows.len() / self.grid.features(), self.capacity(), self.unit());
        self.rows.extend_from_slice(row);
        for j in 0..=new {
            let value = unit * f64::from(dot(row, self.row(j)));
            self.kernel[new * capacity + j] = value;
            self.kernel[j * capacity + new] = value;
        }
    }

    /// Puts the last support vector in the place of another.
    fn swap_remove(&mut self, k: usize, last: usize) {
        let (n, capacity) = (self.grid.features(), self.capacity());
        self.rows.copy_within(last * n..(last + 1) * n, k * n);
        self.rows.truncate(last * n);
        for j in 0..=last {
            self.kernel[k * capacity + j] = self.kernel[last * capacity + j];
        }
        for j in 0..=last {
            self.kernel[j * capacity + k] = self.kernel[j * capacity + last];
        }
    }
}

#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn add_scaled(row: &[f32], by: f32, out: &mut [f32]) {
    for (out, v) in out.iter_mut().zip(row) {
        *out += by * v;
    }
}

impl Dlssvm {
    /// Moves one dual variable to where the dual is greatest, as far as its frame's constraint lets it (ning2016, eq. 9). Where that
    /// constraint stops it, it takes weight from another of its frame: no variable alone would ever get on from there.
    pub(super) fn step(&mut self, k: usize, derived: &Derived) {
        let square = derived.k(k, k);
        if square <= 1e-12 {
            return;
        }
        let v = self.vectors[k];
        let of_frame: f64 = self.vectors.iter().filter(|o| o.pattern == v.pattern).map(|o| o.weight).sum();
        let most = (self.params.c - (of_frame - v.weight)).clamp(0.0, self.params.c);
        let wanted = v.weight + (v.loss - v.margin) / square;
        let weight = wanted.clamp(0.0, most);
        self.shift(k, weight - v.weight, derived);
        self.vectors[k].weight = weight;
        if wanted > most {
            self.take_over(k, derived);
        }
    }

    /// Moves weight to a dual variable from the one of its frame that gains least by its own, as far as that raises the dual.
    fn take_over(&mut self, k: usize, derived: &Derived) {
        let v = self.vectors[k];
        let gain = |v: &Vector| v.loss - v.margin;
        let others = self.vectors.iter().enumerate();
        let others = others.filter(|(l, o)| *l != k && o.pattern == v.pattern && o.weight > 0.0);
        let Some((l, least)) = others.min_by(|a, b| gain(a.1).total_cmp(&gain(b.1))) else { return };
        let curvature = derived.k(k, k) - 2.0 * derived.k(k, l) + derived.k(l, l);
        let rise = gain(&v) - gain(least);
        if rise <= 0.0 || curvature <= 1e-12 {
            return;
        }
        let (left, by) = (least.weight, (rise / curvature).min(least.weight));
        self.shift(k, by, derived);
        self.shift(l, -by, derived);
        self.vectors[k].weight += by;
        self.vectors[l].weight = left - by;
    }

    /// The margins after a dual variable grew by `by`.
    fn shift(&mut self, k: usize, by: f64, derived: &Derived) {
        for (l, other) in self.vectors.iter_mut().enumerate() {
            other.margin += by * derived.k(l, k);
        }
    }

    /// One step for each support vector.
    pub(super) fn pass(&mut self, derived: &Derived) {
        (0..self.vectors.len()).for_each(|k| self.step(k, derived));
    }

    /// The window of a pattern that breaks its constraint most, Δ − w · Ψ, its loss and by how much.
    pub(super) fn worst(&mut self, pattern: usize, shape: &Shape, derived: &mut Derived) -> (Place, f64, f64) {
        derived.weigh(&self.vectors);
        let Derived { grid, weights, .. } = derived;
        let (pattern, planes, windows) = (&self.patterns[pattern], &mut self.scratch.planes, grid.windows);
        expand(&pattern.levels, grid, planes);
        let target = grid.on_canvas(pattern.target);
        let mut lanes = [0.0; LANES];
        let first = pattern.target.x.min(windows.saturating_sub(LANES));
        rate_pattern(planes, grid, weights, Place { x: first, y: pattern.target.y }, &mut lanes);
        let own = f64::from(lanes[pattern.target.x - first]);
        let mut worst = (pattern.target, 0.0, 0.0);
        for y in 0..windows {
            for first in (0..windows).step_by(LANES).map(|x| x.min(windows.saturating_sub(LANES))) {
                rate_pattern(planes, grid, weights, Place { x: first, y }, &mut lanes);
                for (x, rating) in (first..windows).zip(&lanes) {
                    let window = Place { x, y };
                    let loss = 1.0 - shape.overlap(target, grid.on_canvas(window));
                    let by = loss - (own - f64::from(*rating));
                    if by > worst.2 {
                        worst = (window, loss, by);
                    }
                }
            }
        }
        worst
    }

    /// Makes the window of a pattern that breaks its constraint most a support vector, and takes a step with it; whether there
    /// was one.
    pub(super) fn take_worst(&mut self, pattern: usize, shape: &Shape, derived: &mut Derived) -> bool {
        let (window, loss, by) = self.worst(pattern, shape, derived);
        if by <= TOLERANCE {
            return false;
        }
        let known = self.vectors.iter().position(|v| (v.pattern, v.window) == (pattern, window));
        let k = known.unwrap_or_else(|| {
            self.row(pattern, window, &derived.grid);
            derived.push(&self.scratch.row);
            let new = self.vectors.len();
            let margin = self.vectors.iter().enumerate().map(|(l, v)| v.weight * derived.k(l, new)).sum();
            self.vectors.push(Vector { pattern, window, loss, weight: 0.0, margin });
            new
        });
        self.step(k, derived);
        true
    }

    /// Ψ of a window, into the scratch.
    fn row(&mut self, pattern: usize, window: Place, grid: &Grid) {
        let (pattern, Scratch { row, window: other, .. }) = (&self.patterns[pattern], &mut self.scratch);
        bits(&pattern.levels, grid, pattern.target, row);
        bits(&pattern.levels, grid, window, other);
        row.iter_mut().zip(&*other).for_each(|(row, other)| *row -= other);
    }

    pub(super) fn process_new(&mut self, shape: &Shape, canvas: &Canvas, at: Place, derived: &mut Derived) {
        self.scratch.maps.look(canvas, &derived.grid, &self.params);
        let mut pattern = self.scratch.spare.pop().unwrap_or_default();
        self.scratch.maps.pattern(&derived.grid, &mut pattern.levels);
        pattern.target = derived.grid.window_at(at);
        self.patterns.push(pattern);
        self.take_worst(self.patterns.len() - 1, shape, derived);
        self.finish(derived);
    }

    /// Goes over an old frame; whether there is one.
    pub(super) fn process_old(&mut self, shape: &Shape, derived: &mut Derived) -> bool {
        if self.patterns.is_empty() {
            return false;
        }
        let pattern = below(&mut self.random, self.patterns.len());
        self.take_worst(pattern, shape, derived);
        self.finish(derived);
        true
    }

    fn finish(&mut self, derived: &mut Derived) {
        derived.is_current = false;
        self.tidy(derived);
        self.keep_budget(derived);
    }

    /// Drops what has no weight, and patterns of which nothing is left.
    pub(super) fn tidy(&mut self, derived: &mut Derived) {
        for k in (0..self.vectors.len()).rev() {
            if self.vectors[k].weight <= 0.0 {
                self.remove(k, derived);
            }
        }
        for pattern in (0..self.patterns.len()).rev() {
            if self.vectors.iter().all(|v| v.pattern != pattern) {
                self.forget(pattern);
            }
        }
        derived.is_current = false;
    }

    fn remove(&mut self, k: usize, derived: &mut Derived) {
        derived.swap_remove(k, self.vectors.len() - 1);
        self.vectors.swap_remove(k);
    }

    fn forget(&mut self, pattern: usize) {
        let moved = self.patterns.len() - 1;
        self.scratch.spare.push(self.patterns.swap_remove(pattern));
        self.vectors.iter_mut().filter(|v| v.pattern == moved).for_each(|v| v.pattern = pattern);
    }

    /// Removes the support vectors whose going changes w least (ning2016, section 3.2): no other has to take their weight.
    pub(super) fn keep_budget(&mut self, derived: &mut Derived) {
        while self.vectors.len() > self.params.budget {
            let change = |k: usize| self.vectors[k].weight.powi(2) * derived.k(k, k);
            let Some(least) = (0..self.vectors.len()).min_by(|a, b| change(*a).total_cmp(&change(*b))) else { return };
            let gone = self.vectors[least].weight;
            for (l, v) in self.vectors.iter_mut().enumerate() {
                v.margin -= gone * derived.k(l, least);
            }
            self.vectors[least].weight = 0.0;
            self.tidy(derived);
        }
    }

    /// Makes all that follows from patterns and dual variables.
    pub(super) fn derive(&mut self, grid: Grid) {
        let mut derived = Derived::new(grid, self.params.budget + 2);
        for k in 0..self.vectors.len() {
            let Vector { pattern, window, .. } = self.vectors[k];
            self.row(pattern, window, &grid);
            derived.push(&self.scratch.row);
        }
        derived.is_current = false;
        self.derived = Some(derived);
    }

    /// w · Ψ of every support vector.
    pub(super) fn measure_margins(&mut self, derived: &Derived) {
        for k in 0..self.vectors.len() {
            self.vectors[k].margin = self.vectors.iter().enumerate().map(|(l, v)| v.weight * derived.k(l, k)).sum();
        }
    }
}
