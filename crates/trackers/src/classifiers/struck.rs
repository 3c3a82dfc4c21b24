//! `struck`: structured output tracking with kernels (hare2011). A support vector machine learns to rank displacements by how well the
//! window there overlaps the target; LaRank (bordes2007) solves it step by step, with a budget of support vectors.

use super::canvas::{Canvas, LANES, Place, Shape};
use super::haar::{Bank, below};
use super::sigmoids::exp;
use super::{Classifier, ClassifierLocalizer, ClassifierScoreParams, Model, ViewParams, recipe};
use multiversion::multiversion;
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_tracking::{LocalizerRecipe, Result, TrackerRecipe};
use pursuit_vision::patch::dot;
use serde::{Deserialize, Serialize};

pursuit_parameters::parameters! {
    /// Parameters of structured output tracking.
    pub struct StruckParams {
        /// How the target is looked at.
        pub view: ViewParams = ViewParams::default();
        /// Regularisation C.
        pub c: f64 = 100.0, in above(0.0), source "hare2011, section 4: 100";
        /// σ of the Gaussian kernel exp(−σ ‖x − x'‖²).
        pub sigma: f64 = 0.2, in above(0.0).at_most(100.0), source "hare2011, section 4: 0.2";
        /// Most support vectors, B.
        pub budget: usize = 100, in 4..=1000, source "hare2011, section 4: 100";
        /// Old frames gone over after each new one, n_R.
        pub reprocess: usize = 10, in 0..=100, source "hare2011, section 4: 10";
        /// Optimisation steps after each of those, n_O.
        pub optimize: usize = 10, in 0..=100, source "hare2011, section 4: 10";
        /// Circles of displacements that are learnt from.
        pub circles: usize = 5, in 1..=20, source "hare2011, section 4: 5";
        /// Displacements on a circle.
        pub directions: usize = 16, in 4..=64, source "hare2011, section 4: 16";
        /// The score, fitted as `docs/papers/hare2011.md` says.
        pub score: ClassifierScoreParams =
            ClassifierScoreParams { bias: -2.9, rating: -0.6, margin: 2.3, likeness: 5.0 };
    }
}

/// Features of a window.
const FEATURES: usize = 192;
/// Coefficients this small are none.
const NOTHING: f64 = 1e-8;

/// The classifier.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Struck {
    pub(super) params: StruckParams,
    bank: Bank,
    patterns: Vec<Pattern>,
    vectors: Vec<Vector>,
    /// Features of the support vectors, and the squares of their lengths.
    rows: Vec<f32>,
    squares: Vec<f32>,
    random: u64,
    /// Kernel values between support vectors, `capacity` in a row: made anew when a state is read.
    #[serde(skip)]
    kernel: Vec<f64>,
    #[serde(skip)]
    scratch: Scratch,
}

/// A frame that is learnt from: windows at several displacements, the first the target's.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
struct Pattern {
    /// Features, in parts of [`UNIT`].
    features: Vec<i16>,
    /// 1 less the overlap with the target, of each window.
    losses: Vec<f64>,
}

const UNIT: f32 = 32_767.0;

/// A window of a pattern with a coefficient.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Vector {
    pattern: usize,
    sample: usize,
    /// β.
    weight: f64,
    /// −Δ(y) − F(y).
    gradient: f64,
}

#[derive(Debug, Clone, Default)]
struct Scratch {
    places: Vec<Place>,
    sample: Vec<f32>,
    lanes: Vec<[f32; LANES]>,
    spare: Vec<Pattern>,
}

const SEED: u64 = 2011;

impl Pattern {
    fn with_capacity(windows: usize) -> Self {
        Self { features: Vec::with_capacity(windows * FEATURES), losses: Vec::with_capacity(windows) }
    }

    fn sample(&self, k: usize, out: &mut Vec<f32>) {
        out.clear();
        out.extend(self.features[k * FEATURES..(k + 1) * FEATURES].iter().map(|v| f32::from(*v) / UNIT));
    }
}

impl Struck {
    pub fn new(params: &StruckParams, shape: &Shape) -> Self {
        let (bank, capacity) = (Bank::grid(shape), params.budget + 2);
        let windows = 1 + params.circles * params.directions;
        // Each has at least two support vectors.
        let spare = (0..=capacity / 2).map(|_| Pattern::with_capacity(windows)).collect();
        Self {
            params: params.clone(),
            bank,
            patterns: Vec::with_capacity(capacity),
            vectors: Vec::with_capacity(capacity),
            rows: Vec::with_capacity(capacity * FEATURES),
            squares: Vec::with_capacity(capacity),
            random: SEED,
            kernel: vec![0.0; capacity * capacity],
            scratch: Scratch { spare, ..Scratch::default() },
        }
    }

    fn capacity(&self) -> usize {
        self.params.budget + 2
    }

    /// Kernel values between support vectors.
    fn k(&self, a: usize, b: usize) -> f64 {
        self.kernel[a * self.capacity() + b]
    }

    /// Of the features `x` and the support vector `j`.
    fn kernel_with(&self, x: &[f32], square: f32, j: usize) -> f64 {
        let distance = square + self.squares[j] - 2.0 * dot(x, &self.rows[j * FEATURES..(j + 1) * FEATURES]);
        f64::from(exp((-(self.params.sigma as f32) * distance.max(0.0)).max(-80.0)))
    }

    /// F(x).
    fn rating(&self, x: &[f32]) -> f64 {
        let square = dot(x, x);
        self.vectors.iter().enumerate().map(|(j, v)| v.weight * self.kernel_with(x, square, j)).sum()
    }

    /// The support vector of a window of a pattern, a new one where there is none.
    fn vector_of(&mut self, pattern: usize, sample: usize) -> usize {
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
    fn step(&mut self, to: usize, from: usize) {
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
    fn shift(&mut self, to: usize, from: usize, by: f64) {
        for l in 0..self.vectors.len() {
            self.vectors[l].gradient -= by * (self.k(l, to) - self.k(l, from));
        }
    }

    /// Drops what has no weight, and patterns of which nothing is left.
    fn tidy(&mut self) {
        for k in (0..self.vectors.len()).rev() {
            if self.vectors[k].weight.abs() < NOTHING {
                self.remove(k);
            }
        }
    }

    fn remove(&mut self, k: usize) {
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
    fn worst_of_all(&mut self, pattern: usize) -> usize {
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
    fn extremes(&self, pattern: usize) -> Option<(usize, usize)> {
        let own = || self.vectors.iter().enumerate().filter(|(_, v)| v.pattern == pattern);
        let may_get_more = |v: &Vector| v.weight < if v.sample == 0 { self.params.c } else { 0.0 } - NOTHING;
        let gradient = |a: &(usize, &Vector), b: &(usize, &Vector)| a.1.gradient.total_cmp(&b.1.gradient);
        let to = own().filter(|(_, v)| may_get_more(v)).max_by(gradient)?;
        let from = own().min_by(gradient)?;
        Some((to.0, from.0))
    }

    fn process_old(&mut self) {
        let pattern = below(&mut self.random, self.patterns.len());
        let Some((to, _)) = self.extremes(pattern) else { return };
        let worst = self.worst_of_all(pattern);
        let from = self.vector_of(pattern, worst);
        self.step(to, from);
        self.tidy();
        self.keep_budget();
    }

    fn optimize(&mut self) {
        let pattern = below(&mut self.random, self.patterns.len());
        let Some((to, from)) = self.extremes(pattern) else { return };
        self.step(to, from);
        self.tidy();
    }

    /// Removes the negative support vectors that change the function least, their weight going to the positive one of the same
    /// pattern (hare2011, section 3.3).
    fn keep_budget(&mut self) {
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
            let Some((_, r, p)) = least else { return };
            let weight = self.vectors[r].weight;
            self.vectors[p].weight += weight;
            self.vectors[r].weight = 0.0;
            self.shift(p, r, weight);
            self.tidy();
        }
    }

    fn process_new(&mut self, shape: &Shape, canvas: &Canvas, at: Place) {
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
    fn remake_kernel(&mut self) {
        let (n, capacity) = (self.vectors.len(), self.capacity());
        self.kernel = vec![0.0; capacity * capacity];
        for i in 0..n {
            let x = &self.rows[i * FEATURES..(i + 1) * FEATURES];
            let values: Vec<f64> = (0..n).map(|j| self.kernel_with(x, self.squares[i], j)).collect();
            self.kernel[i * capacity..i * capacity + n].copy_from_slice(&values);
            self.kernel[i * capacity + i] = 1.0;
        }
    }

    /// As it was before it was saved.
    pub fn restored(mut self) -> Self {
        self.remake_kernel();
        self
    }
}

impl Classifier for Struck {
    fn rate(&mut self, canvas: &Canvas, at: Place, out: &mut [f32; LANES]) {
        let lanes = &mut self.scratch.lanes;
        lanes.resize(FEATURES, [0.0; LANES]);
        lanes.iter_mut().enumerate().for_each(|(k, lanes)| self.bank.get(k).lanes(canvas, at, lanes));
        let mut squares = [0.0; LANES];
        add_squares(lanes, &mut squares);
        out.fill(0.0);
        let sigma = self.params.sigma as f32;
        for (pair, rows) in self.vectors.chunks(2).zip(self.rows.chunks(2 * FEATURES)) {
            let of = |k: usize| pair.get(k).map_or(0.0, |v| v.weight as f32);
            let (a, b) =
                (&rows[..FEATURES], rows.get(FEATURES..).filter(|b| !b.is_empty()).unwrap_or(&rows[..FEATURES]));
            add_kernels(lanes, &squares, [a, b], [of(0), of(1)], sigma, out);
        }
    }

    fn learn(&mut self, shape: &Shape, canvas: &Canvas, at: Place) {
        self.process_new(shape, canvas, at);
        for _ in 0..self.params.reprocess {
            if self.patterns.is_empty() {
                return;
            }
            self.process_old();
            for _ in 0..self.params.optimize {
                if self.patterns.is_empty() {
                    return;
                }
                self.optimize();
            }
        }
    }

    fn is_sound(&self, shape: &Shape) -> bool {
        let windows = 1 + self.params.circles * self.params.directions;
        let pattern = |p: &Pattern| {
            let losses = p.losses.iter().all(|l| (0.0..=1.0).contains(l));
            p.losses.len() == windows && p.features.len() == windows * FEATURES && losses
        };
        let vector = |v: &Vector| {
            let finite = v.weight.is_finite() && v.gradient.is_finite();
            v.pattern < self.patterns.len() && v.sample < windows && finite
        };
        let n = self.vectors.len();
        self.bank.is_sound(shape, FEATURES)
            && n <= self.params.budget
            && self.patterns.iter().all(pattern)
            && self.vectors.iter().all(vector)
            && self.rows.len() == n * FEATURES
            && self.squares.len() == n
            && self.rows.iter().chain(&self.squares).all(|v| v.is_finite())
    }
}

#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn add_squares(lanes: &[[f32; LANES]], out: &mut [f32; LANES]) {
    for lane in lanes {
        for i in 0..LANES {
            out[i] += lane[i] * lane[i];
        }
    }
}

/// Adds two weighted kernel values of every lane.
#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn add_kernels(
    lanes: &[[f32; LANES]],
    squares: &[f32; LANES],
    [a, b]: [&[f32]; 2],
    weights: [f32; 2],
    sigma: f32,
    out: &mut [f32; LANES],
) {
    let (mut dots_a, mut dots_b) = ([0.0f32; LANES], [0.0f32; LANES]);
    let (mut square_a, mut square_b) = (0.0f32, 0.0f32);
    for ((lane, &a), &b) in lanes.iter().zip(a).zip(b) {
        for i in 0..LANES {
            dots_a[i] += a * lane[i];
            dots_b[i] += b * lane[i];
        }
        square_a += a * a;
        square_b += b * b;
    }
    for i in 0..LANES {
        let value = |dot: f32, square: f32| exp((-sigma * (squares[i] + square - 2.0 * dot).max(0.0)).max(-80.0));
        out[i] += weights[0] * value(dots_a[i], square_a) + weights[1] * value(dots_b[i], square_b);
    }
}

impl LocalizerRecipe for StruckParams {
    type Localizer = ClassifierLocalizer;

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<ClassifierLocalizer> {
        let model = |shape: &Shape| Model::Struck(Struck::new(self, shape));
        Ok(ClassifierLocalizer::new(&self.view, &self.score, frame, bbox, model))
    }
}

/// `struck`.
pub fn struck(name: &'static str) -> TrackerRecipe<StruckParams> {
    recipe(name, StruckParams::default())
}

#[cfg(test)]
mod tests {
    use super::super::twins::{canvas, canvas_at, ratings};
    use super::*;

    /// The function by its definition.
    fn slow(struck: &Struck, x: &[f32]) -> f64 {
        let kernel = |row: &[f32]| {
            let distance: f64 = x.iter().zip(row).map(|(a, b)| f64::from(a - b).powi(2)).sum();
            (-struck.params.sigma * distance).exp()
        };
        struck.vectors.iter().zip(struck.rows.chunks(FEATURES)).map(|(v, row)| v.weight * kernel(row)).sum()
    }

    fn taught(params: &StruckParams, frames: usize) -> (Shape, Struck) {
        let (shape, _) = canvas();
        let mut struck = Struck::new(params, &shape);
        (0..frames).for_each(|k| struck.learn(&shape, &canvas_at(k as f64).1, shape.middle()));
        (shape, struck)
    }

    #[test]
    fn ratings_and_gradients_are_by_their_definition() {
        let (shape, mut struck) = taught(&StruckParams::default(), 8);
        let canvas = canvas_at(3.0).1;
        let (best, all) = ratings(&mut struck, &shape, &canvas);
        assert!(best.x.abs_diff(shape.middle().x) <= 1 && best.y.abs_diff(shape.middle().y) <= 1, "{best:?}");
        for place in [best, Place { x: 0, y: 0 }, Place { x: 40, y: 7 }, Place { x: 63, y: 63 }] {
            let mut x = vec![0.0; FEATURES];
            struck.bank.values(&canvas, place, &mut x);
            let (got, want) = (f64::from(all[place.y * shape.windows() + place.x]), slow(&struck, &x));
            assert!((got - want).abs() < 1e-2 * (1.0 + want.abs()), "{place:?}: {got} is not {want}");
        }
        for (k, v) in struck.vectors.iter().enumerate() {
            let want =
                -struck.patterns[v.pattern].losses[v.sample] - slow(&struck, &struck.rows[k * FEATURES..][..FEATURES]);
            assert!((v.gradient - want).abs() < 1e-2 * (1.0 + want.abs()), "{k}: {} is not {want}", v.gradient);
        }
    }

    #[test]
    fn the_dual_keeps_its_constraints_and_its_budget() {
        let params = StruckParams { budget: 12, ..StruckParams::default() };
        let (shape, struck) = taught(&params, 25);
        assert!(struck.is_sound(&shape) && struck.vectors.len() <= 12 && !struck.vectors.is_empty());
        for pattern in 0..struck.patterns.len() {
            let own = || struck.vectors.iter().filter(|v| v.pattern == pattern);
            assert!(own().map(|v| v.weight).sum::<f64>().abs() < 1e-6, "weights of a frame add up to nothing");
            assert!(own().all(|v| if v.sample == 0 { v.weight <= params.c + 1e-9 } else { v.weight <= 1e-9 }));
        }
    }

    #[test]
    fn optimization_raises_the_dual() {
        let objective = |s: &Struck| {
            let linear: f64 = s.vectors.iter().map(|v| -s.patterns[v.pattern].losses[v.sample] * v.weight).sum();
            let norm: f64 = (0..s.vectors.len())
                .flat_map(|i| (0..s.vectors.len()).map(move |j| (i, j)))
                .map(|(i, j)| s.vectors[i].weight * s.vectors[j].weight * s.k(i, j))
                .sum();
            linear - 0.5 * norm
        };
        let (_, mut struck) = taught(&StruckParams { reprocess: 0, ..StruckParams::default() }, 6);
        let before = objective(&struck);
        (0..20).for_each(|_| struck.process_old());
        (0..100).for_each(|_| struck.optimize());
        assert!(objective(&struck) > before, "{} is not above {before}", objective(&struck));
    }

    #[test]
    fn restored_kernels_are_as_they_were() {
        let (_, struck) = taught(&StruckParams::default(), 5);
        let again = Struck { kernel: Vec::new(), ..struck.clone() }.restored();
        for (i, j) in (0..struck.vectors.len()).flat_map(|i| (0..struck.vectors.len()).map(move |j| (i, j))) {
            assert!((again.k(i, j) - struck.k(i, j)).abs() < 1e-6);
        }
    }
}
