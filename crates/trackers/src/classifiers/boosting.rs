//! `boosting`: online boosting for feature selection (grabner2006). Each of some selectors holds to the weak classifier that errs least on the
//! samples which those before it got wrong.

use super::canvas::{Canvas, LANES, Place, Shape};
use super::gaussian::Normal;
use super::haar::{Bank, Haar};
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
    /// Parameters of online boosting.
    pub struct BoostingParams {
        /// How the target is looked at.
        pub view: ViewParams = ViewParams::default();
        /// Selectors, N.
        pub selectors: usize = 50, in 1..=200, source "grabner2006, section 3: 50";
        /// Weak classifiers that all selectors choose from, M.
        pub features: usize = 250, in 200..=2000, source "grabner2006, section 3: 250";
        /// Share of a sample in what is known of a feature.
        pub learning_rate: f64 = 0.05, in 0.0..=1.0, source "ours";
        /// Share of a sample that stays in the errors counted.
        pub forgetting: f64 = 0.99, in above(0.0).at_most(1.0), source "ours";
        /// Negative windows of a frame, on circles about the target.
        pub negatives: usize = 24, in 4..=500, source "grabner2006, section 2.2: four, one at each corner";
        /// How often the first frame is learnt.
        pub first_rounds: usize = 50, in 1..=1000, source "the authors' program: 50";
        /// The score, fitted as `docs/papers/grabner2006.md` says.
        pub score: ClassifierScoreParams =
            ClassifierScoreParams { bias: -6.5, rating: 0.0, margin: 2.3, likeness: 2.6, colors: 5.3 };
    }
}

/// The classifier.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Boosting {
    pub(super) params: BoostingParams,
    bank: Bank,
    weak: Vec<Weak>,
    selectors: Vec<Selector>,
    /// Weights of right and wrong answers, of each selector's view of each weak classifier.
    counts: Vec<(f32, f32)>,
    random: u64,
    rounds: usize,
    #[serde(skip)]
    scratch: Scratch,
}

/// A threshold between what a feature is on the target and elsewhere.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Weak {
    on: Normal,
    off: Normal,
}

impl Weak {
    const UNTAUGHT: Self = Self { on: Normal { mean: 0.0, variance: 1.0 }, off: Normal { mean: 0.0, variance: 1.0 } };

    fn learn(&mut self, value: f32, is_target: bool, rate: f32) {
        let normal = if is_target { &mut self.on } else { &mut self.off };
        let away = value - normal.mean;
        normal.blend(&Normal { mean: value, variance: away * away }, rate);
    }

    /// The threshold, and on which side of it the target is (grabner2006, eq. 6).
    fn threshold(&self) -> (f32, f32) {
        (0.5 * (self.on.mean + self.off.mean), if self.on.mean >= self.off.mean { 1.0 } else { -1.0 })
    }

    fn says_target(&self, value: f32) -> bool {
        let (threshold, sign) = self.threshold();
        sign * (value - threshold) > 0.0
    }
}

/// A weak classifier and its vote.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Selector {
    weak: usize,
    vote: f32,
}

#[derive(Debug, Clone, Default)]
struct Scratch {
    places: Vec<Place>,
    values: Vec<f32>,
    is_right: Vec<bool>,
    is_taken: Vec<bool>,
}

const SEED: u64 = 2006;

impl Boosting {
    pub fn new(params: &BoostingParams, shape: &Shape) -> Self {
        let mut random = SEED;
        let bank = Bank::random(shape, params.features, &mut random);
        Self {
            params: params.clone(),
            bank,
            weak: vec![Weak::UNTAUGHT; params.features],
            selectors: vec![Selector { weak: 0, vote: 0.0 }; params.selectors],
            counts: vec![(1.0, 1.0); params.features * params.selectors],
            random,
            rounds: 0,
            scratch: Scratch::default(),
        }
    }

    /// One sample passes all selectors, and weighs more for the next where one was wrong (grabner2006, algorithm 2.1).
    fn pass(&mut self, canvas: &Canvas, at: Place, is_target: bool) {
        let (rate, keep, features) = (self.params.learning_rate as f32, self.params.forgetting as f32, self.bank.len());
        let Scratch { values, is_right, is_taken, .. } = &mut self.scratch;
        values.clear();
        values.resize(features, 0.0);
        self.bank.values(canvas, at, values);
        is_right.clear();
        is_taken.clear();
        is_taken.resize(features, false);
        // At first the mean of what was seen, later a running one.
        let rate = rate.max(1.0 / (self.rounds + 1) as f32);
        for (weak, value) in self.weak.iter_mut().zip(values.iter()) {
            weak.learn(*value, is_target, rate);
            is_right.push(weak.says_target(*value) == is_target);
        }
        let mut weight = 1.0_f32;
        for (selector, counts) in self.selectors.iter_mut().zip(self.counts.chunks_exact_mut(features)) {
            let mut best = (0, f32::INFINITY);
            for (k, (count, right)) in counts.iter_mut().zip(is_right.iter()).enumerate() {
                let (more_right, more_wrong) = if *right { (weight, 0.0) } else { (0.0, weight) };
                *count = (keep * count.0 + more_right, keep * count.1 + more_wrong);
                let error = count.1 / (count.0 + count.1);
                // Many err alike little: no two selectors hold to the same.
                if error < best.1 && !is_taken[k] {
                    best = (k, error);
                }
            }
            is_taken[best.0] = true;
            let error = best.1.clamp(LEAST_ERROR, 1.0 - LEAST_ERROR);
            *selector = Selector { weak: best.0, vote: 0.5 * ((1.0 - error) / error).ln() };
            let by = if is_right[best.0] { 1.0 - error } else { error };
            weight = (weight / (2.0 * by)).clamp(1.0 / MOST_WEIGHT, MOST_WEIGHT);
        }
    }

    /// Puts a new weak classifier in the place of the one that errs most for the last selector and that none holds to.
    fn replace_worst(&mut self, shape: &Shape) {
        let features = self.bank.len();
        let last = &self.counts[features * (self.selectors.len() - 1)..];
        let error = |k: usize| last[k].1 / (last[k].0 + last[k].1);
        let is_free = |k: &usize| self.selectors.iter().all(|s| s.weak != *k);
        let Some(worst) = (0..features).filter(is_free).max_by(|a, b| error(*a).total_cmp(&error(*b))) else { return };
        self.bank.replace(worst, Haar::random(shape, &mut self.random));
        self.weak[worst] = Weak::UNTAUGHT;
        self.counts.iter_mut().skip(worst).step_by(features).for_each(|count| *count = (1.0, 1.0));
    }

    /// Negative windows: on three circles, the nearest of which overlaps the target by less than half.
    fn sample(&mut self, shape: &Shape, at: Place) {
        let places = &mut self.scratch.places;
        places.clear();
        let n = self.params.negatives;
        for k in 0..n {
            let angle = std::f64::consts::TAU * (k as f64 + 0.5) / n as f64;
            let far = [0.45, 0.7, 1.0][k % 3];
            let (dx, dy) = (far * shape.width as f64 * angle.cos(), far * shape.height as f64 * angle.sin());
            places.push(shape.about(at, dx, dy));
        }
    }
}

/// Votes stay finite.
const LEAST_ERROR: f32 = 1e-3;
/// And so do weights.
const MOST_WEIGHT: f32 = 1e3;

impl Classifier for Boosting {
    fn rate(&mut self, canvas: &Canvas, at: Place, out: &mut [f32; LANES]) {
        out.fill(0.0);
        let mut values = [0.0; LANES];
        let mut votes = 0.0;
        for selector in &self.selectors {
            let (threshold, sign) = self.weak[selector.weak].threshold();
            self.bank.get(selector.weak).lanes(canvas, at, &mut values);
            votes += selector.vote.abs();
            vote(&values, threshold, sign * selector.vote, out);
        }
        let scale = 1.0 / votes.max(f32::MIN_POSITIVE);
        out.iter_mut().for_each(|v| *v *= scale);
    }

    fn learn(&mut self, shape: &Shape, canvas: &Canvas, at: Place) {
        self.sample(shape, at);
        let rounds = if self.rounds == 0 { self.params.first_rounds } else { 1 };
        for _ in 0..rounds {
            for k in 0..self.scratch.places.len() {
                let place = self.scratch.places[k];
                self.pass(canvas, at, true);
                self.pass(canvas, place, false);
            }
            self.rounds = self.rounds.saturating_add(1);
            self.replace_worst(shape);
        }
    }

    fn is_sound(&self, shape: &Shape) -> bool {
        let BoostingParams { features, selectors, .. } = self.params;
        self.params.check_all().is_ok()
            && self.bank.is_sound(shape, features)
            && self.weak.len() == features
            && self.weak.iter().all(|w| w.on.is_sound() && w.off.is_sound())
            && self.selectors.len() == selectors
            && self.selectors.iter().all(|s| s.weak < features && s.vote.is_finite())
            && self.counts.len() == features * selectors
            && self.counts.iter().all(|c| c.0.is_finite() && c.1.is_finite() && c.0 > 0.0 && c.1 > 0.0)
    }
}

#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn vote(values: &[f32; LANES], threshold: f32, vote: f32, out: &mut [f32; LANES]) {
    for i in 0..LANES {
        out[i] += if values[i] > threshold { vote } else { -vote };
    }
}

impl LocalizerRecipe for BoostingParams {
    type Localizer = ClassifierLocalizer;

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<ClassifierLocalizer> {
        let model = |shape: &Shape| Model::Boosting(Boosting::new(self, shape));
        Ok(ClassifierLocalizer::new(&self.view, &self.score, frame, bbox, model))
    }
}

/// `boosting`.
pub fn boosting(name: &'static str) -> TrackerRecipe<BoostingParams> {
    recipe(name, BoostingParams::default(), wary(PolicyParams::patient()))
}

#[cfg(test)]
mod tests {
    use super::super::twins::{canvas, ratings};
    use super::*;

    #[test]
    fn thresholds_part_what_was_seen() {
        let mut weak = Weak::UNTAUGHT;
        for k in 0..200 {
            weak.learn(if k % 2 == 0 { 7.0 } else { 1.0 } + (k % 7) as f32 * 0.1, k % 2 == 0, 0.1);
        }
        assert!(weak.says_target(6.5) && !weak.says_target(2.0), "{weak:?}");
    }

    #[test]
    fn ratings_are_shares_of_votes_and_the_target_has_most() {
        let (shape, canvas) = canvas();
        let mut boosting = Boosting::new(&BoostingParams { first_rounds: 10, ..BoostingParams::default() }, &shape);
        boosting.learn(&shape, &canvas, shape.middle());
        let (best, all) = ratings(&mut boosting, &shape, &canvas);
        assert!(all.iter().all(|v| (-1.001..=1.001).contains(v)));
        let away = (best.x as f64 - shape.middle().x as f64).hypot(best.y as f64 - shape.middle().y as f64);
        assert!(away <= 4.0, "{best:?}");
        // One window by its definition.
        let selected = |s: &Selector| {
            let says = boosting.weak[s.weak].says_target(boosting.bank.get(s.weak).value(&canvas, best));
            s.vote * if says { 1.0 } else { -1.0 }
        };
        let votes: f32 = boosting.selectors.iter().map(|s| s.vote.abs()).sum();
        let want = boosting.selectors.iter().map(selected).sum::<f32>() / votes;
        assert!((all[best.y * shape.windows() + best.x] - want).abs() < 1e-3);
        assert!(boosting.is_sound(&shape));
    }
}
