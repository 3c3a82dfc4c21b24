//! `struck`: structured output tracking with kernels (hare2011). A support vector machine learns to rank displacements by how well the
//! window there overlaps the target; LaRank (bordes2007) solves it step by step, with a budget of support vectors.

mod solver;
#[cfg(test)]
mod tests;

use super::canvas::{Canvas, LANES, Place, Shape};
use super::haar::Bank;
use super::sigmoids::exp;
use super::{Classifier, ClassifierLocalizer, ClassifierScoreParams, Model, ViewParams, recipe};
use crate::wary::wary;
use multiversion::multiversion;
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_parameters::Parameters;
use pursuit_tracking::policy::PolicyParams;
use pursuit_tracking::{LocalizerRecipe, Result, TrackerRecipe};
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
            ClassifierScoreParams { bias: -7.0, rating: 0.0, margin: 0.5, likeness: 3.4, colors: 6.0 };
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
        self.params.check_all().is_ok()
            && self.bank.is_sound(shape, FEATURES)
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
    recipe(name, StruckParams::default(), wary(PolicyParams::patient()))
}
