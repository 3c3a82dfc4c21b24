//! The support vectors and their weights: LaRank (bordes2007) as hare2011 has it.

use super::super::canvas::{Canvas, Place, Shape};
use super::super::haar::below;
use super::super::sigmoids::exp;
use super::{Classifier, FEATURES, NOTHING, Scratch, Struck, StruckParams, UNIT, Vector};
use pursuit_vision::patch::dot;

impl Struck {
    pub(super) fn capacity(&self) -> usize {
        self.params.budget + 2
    }

    /// Kernel values between support vectors.
    pub(super) fn k(&self, a: usize, b: usize) -> f64 {
        self.kernel[a * self.capacity() + b]
    }

    /// Of the features `x` and the support vector `j`.
    pub(super) fn kernel_with(&self, x: &[f32], square: f32, j: usize) -> f64 {
        let distance = square + self.squares[j] - 2.0 * dot(x, &self.rows[j * FEATURES..(j + 1) * FEATURES]);
        f64::from(exp((-(self.params.sigma as f32) * distance.max(0.0)).max(-80.0)))
    }

    /// F(x).
    pub(super) fn rating(&self, x: &[f32]) -> f64 {
        let square = dot(x, x);
        self.vectors.iter().enumerate().map(|(j, v)| v.weight * self.kernel_with(x, square, j)).sum()
    }

    /// The support vector of a window of a pattern, a new one where there is none.
    pub(super) fn vector_of(&mut self, pattern: usize, sample: usize) -> usize {
        if let Some(known) = self.vectors.iter().position(|v| (v.pattern, v.sample) == (pattern, sample)) {
            return known;
        }
        let mut x = std::mem::take(&mut self.scratch.sample);
        self.patterns[pattern].sample(sample, &mut x);
        let gradient = -self.patterns[pattern].losses[sample] - self.rating(&x);
        let (new, square, capacity) = (self.vectors.len(), dot(&x, &x), self.capacity());
        for j in 0..new {
            let value = self.kernel_with(&x, square, j);
            self.kernel[new * capacity + j] = value;
            self.kernel[j * capacity + new] = value;
        }
        self.kernel[new * capacity + new] = 1.0;
        self.vectors.push(Vector { pattern, sample, weight: 0.0, gradient });
        self.rows.extend_from_slice(&x);
        self.squares.push(square);
        self.scratch.sample = x;
        new
    }

    /// Moves weight from one window of a pattern to another as far as that helps (hare2011, algorithm 1).
    pub(super) fn step(&mut self, to: usize, from: usize) {
        if to == from {
            return;
        }
        let curvature = 2.0 - 2.0 * self.k(to, from);
        if curvature <= 1e-12 {
            return;
        }
        let (v, w) = (self.vectors[to], self.vectors[from]);
        let most = if v.sample == 0 { self.params.c } else { 0.0 } - v.weight;
        let by = ((v.gradient - w.gradient) / curvature).min(most).max(0.0);
        self.vectors[to].weight += by;
        self.vectors[from].weight -= by;
        self.shift(to, from, by);
    }

    /// The gradients after weight `by` went to one support vector from another.
    pub(super) fn shift(&mut self, to: usize, from: usize, by: f64) {
        for l in 0..self.vectors.len() {
            self.vectors[l].gradient -= by * (self.k(l, to) - self.k(l, from));
        }
    }

    /// Drops what has no weight, and patterns of which nothing is left.
    pub(super) fn tidy(&mut self) {
        for k in (0..self.vectors.len()).rev() {
            if self.vectors[k].weight.abs() < NOTHING {
                self.remove(k);
            }
        }
    }

    pub(super) fn remove(&mut self, k: usize) {
        let (last, capacity) = (self.vectors.len() - 1, self.capacity());
        let pattern = self.vectors.swap_remove(k).pattern;
        self.squares.swap_remove(k);
        self.rows.copy_within(last * FEATURES..(last + 1) * FEATURES, k * FEATURES);
        self.rows.truncate(last * FEATURES);
        for j in 0..=last {
            self.kernel[k * capacity + j] = self.kernel[last * capacity + j];
        }
        for j in 0..=last {
            self.kernel[j * capacity + k] = self.kernel[j * capacity + last];
        }
        if self.vectors.iter().all(|v| v.pattern != pattern) {
            let moved = self.patterns.len() - 1;
            self.scratch.spare.push(self.patterns.swap_remove(pattern));
            self.vectors.iter_mut().filter(|v| v.pattern == moved).for_each(|v| v.pattern = pattern);
        }
    }

    /// The window of a pattern that should get less: the one of least gradient among all.
    pub(super) fn worst_of_all(&mut self, pattern: usize) -> usize {
        let mut x = std::mem::take(&mut self.scratch.sample);
        let mut worst = (0, f64::INFINITY);
        for k in 0..self.patterns[pattern].losses.len() {
            let known = self.vectors.iter().find(|v| (v.pattern, v.sample) == (pattern, k)).map(|v| v.gradient);
            let gradient = known.unwrap_or_else(|| {
                self.patterns[pattern].sample(k, &mut x);
                -self.patterns[pattern].losses[k] - self.rating(&x)
            });
            if gradient < worst.1 {
                worst = (k, gradient);
            }
        }
        self.scratch.sample = x;
        worst.0
    }

    /// The support vectors of a pattern that may get more, and that should get less.
    pub(super) fn extremes(&self, pattern: usize) -> Option<(usize, usize)> {
        let own = || self.vectors.iter().enumerate().filter(|(_, v)| v.pattern == pattern);
        let may_get_more = |v: &Vector| v.weight < if v.sample == 0 { self.params.c } else { 0.0 } - NOTHING;
        let gradient = |a: &(usize, &Vector), b: &(usize, &Vector)| a.1.gradient.total_cmp(&b.1.gradient);
        let to = own().filter(|(_, v)| may_get_more(v)).max_by(gradient)?;
        let from = own().min_by(gradient)?;
        Some((to.0, from.0))
    }

    pub(super) fn process_old(&mut self) {
        let pattern = below(&mut self.random, self.patterns.len());
        let Some((to, _)) = self.extremes(pattern) else { return };
        let worst = self.worst_of_all(pattern);
        let from = self.vector_of(pattern, worst);
        self.step(to, from);
        self.tidy();
        self.keep_budget();
    }

    pub(super) fn optimize(&mut self) {
        let pattern = below(&mut self.random, self.patterns.len());
        let Some((to, from)) = self.extremes(pattern) else { return };
        self.step(to, from);
        self.tidy();
    }

    /// Removes the negative support vectors that change the function least, their weight going to the positive one of the same
    /// pattern (hare2011, section 3.3).
    pub(super) fn keep_budget(&mut self) {
        while self.vectors.len() > self.params.budget {
            let mut least: Option<(f64, usize, usize)> = None;
            for (r, v) in self.vectors.iter().enumerate().filter(|(_, v)| v.weight < 0.0) {
                let is_its_positive = |(_, p): &(usize, &Vector)| p.pattern == v.pattern && p.weight > 0.0;
                let Some((p, _)) = self.vectors.iter().enumerate().find(is_its_positive) else { continue };
                let change = v.weight * v.weight * (2.0 - 2.0 * self.k(r, p));
                if least.is_none_or(|(known, ..)| change < known) {
                    least = Some((change, r, p));
                }
            }
            let Some((_, r, p)) = least else {
                // Learning leaves no such state, but one that was read may be: the budget holds all the same.
                self.remove(self.vectors.len() - 1);
                continue;
            };
            let weight = self.vectors[r].weight;
            self.vectors[p].weight += weight;
            self.vectors[r].weight = 0.0;
            self.shift(p, r, weight);
            self.tidy();
        }
    }

    pub(super) fn process_new(&mut self, shape: &Shape, canvas: &Canvas, at: Place) {
        let StruckParams { circles, directions, .. } = self.params;
        let Scratch { places, sample, spare, .. } = &mut self.scratch;
        places.clear();
        places.push(at);
        for circle in 1..=circles {
            for k in 0..directions {
                let radius = shape.reach as f64 * circle as f64 / circles as f64;
                // Every other circle is turned by half a step.
                let turn = if circle % 2 == 0 { 0.5 } else { 0.0 };
                let angle = std::f64::consts::TAU * (k as f64 + turn) / directions as f64;
                places.push(shape.about(at, radius * angle.cos(), radius * angle.sin()));
            }
        }
        let mut pattern = spare.pop().unwrap_or_default();
        pattern.features.clear();
        pattern.losses.clear();
        sample.resize(FEATURES, 0.0);
        for place in places.iter() {
            self.bank.values(canvas, *place, sample);
            pattern.features.extend(sample.iter().map(|v| (v.clamp(-1.0, 1.0) * UNIT).round() as i16));
            pattern.losses.push(1.0 - shape.overlap(at, *place));
        }
        self.patterns.push(pattern);
        let new = self.patterns.len() - 1;
        let worst = self.worst_of_all(new);
        if worst == 0 {
            // It is ranked first by more than the others' losses: there is nothing to learn.
            if self.vectors.iter().all(|v| v.pattern != new) {
                let known = self.patterns.swap_remove(new);
                self.scratch.spare.push(known);
            }
            return;
        }
        let to = self.vector_of(new, 0);
        let from = self.vector_of(new, worst);
        self.step(to, from);
        self.tidy();
        self.keep_budget();
    }

    /// Kernel values between the support vectors, of a state that was read.
    pub(super) fn remake_kernel(&mut self) {
        let (n, capacity) = (self.vectors.len(), self.capacity());
        self.kernel = vec![0.0; capacity * capacity];
        for i in 0..n {
            let x = &self.rows[i * FEATURES..(i + 1) * FEATURES];
            let values: Vec<f64> = (0..n).map(|j| self.kernel_with(x, self.squares[i], j)).collect();
            self.kernel[i * capacity..i * capacity + n].copy_from_slice(&values);
            self.kernel[i * capacity + i] = 1.0;
        }
    }

    /// As it was before it was saved, where that is sound.
    pub fn restored(mut self, shape: &Shape) -> Option<Self> {
        if !self.is_sound(shape) {
            return None;
        }
        self.remake_kernel();
        Some(self)
    }
}
