//! `mil`: online multiple instance boosting (babenko2011). Where exactly the target is, is not believed: windows near its place make one
//! bag, of which at least one shows it.

use super::canvas::{Canvas, LANES, Place, Shape};
use super::gaussian::{LogRatio, Normal};
use super::haar::{Bank, below, unit};
use super::sigmoids::log_none;
use super::{Classifier, ClassifierLocalizer, ClassifierScoreParams, Model, ViewParams, recipe};
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_parameters::Parameters;
use pursuit_tracking::policy::PolicyParams;
use pursuit_tracking::{LocalizerRecipe, Result, TrackerRecipe};
use serde::{Deserialize, Serialize};

pursuit_parameters::parameters! {
    /// Parameters of online multiple instance boosting.
    pub struct MilParams {
        /// How the target is looked at.
        pub view: ViewParams = ViewParams::default();
        /// Weak classifiers, M.
        pub features: usize = 250, in 8..=2000, source "babenko2011, section 4.1: 250";
        /// Weak classifiers chosen in each frame, K.
        pub chosen: usize = 50, in 1..=500, source "babenko2011, section 4.1: 50";
        /// Share of a frame in what is known of a feature, 1 − γ.
        pub learning_rate: f64 = 0.15, in 0.0..=1.0, source "babenko2011, section 4.1: γ = 0.85";
        /// Windows up to so far from the target's place make the positive bag.
        pub near: f64 = 4.0, in 1.0..=16.0, unit "canvas px", source "babenko2011, section 4.1: 4";
        /// Windows at least so far from it are negative.
        pub far: f64 = 8.0, in 2.0..=64.0, unit "canvas px", source "ours";
        /// Windows in the positive bag.
        pub positives: usize = 45, in 1..=500, source "babenko2011, section 4.1: about 45";
        /// Negative windows.
        pub negatives: usize = 65, in 1..=1000, source "babenko2011, section 4.1: 65";
        /// The score, fitted as `docs/papers/babenko2011.md` says.
        pub score: ClassifierScoreParams =
            ClassifierScoreParams { bias: -8.6, rating: 0.0, margin: 0.3, likeness: 2.4, colors: 8.0 };
    }
}

/// The classifier.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Mil {
    pub(super) params: MilParams,
    bank: Bank,
    /// What values each feature has on the target and elsewhere.
    known: Vec<(Normal, Normal)>,
    chosen: Vec<usize>,
    random: u64,
    /// The weak classifiers chosen: made anew when a state is read.
    #[serde(skip)]
    ratios: Vec<LogRatio>,
    #[serde(skip)]
    scratch: Scratch,
}

/// Overwritten at every use.
#[derive(Debug, Clone, Default)]
struct Scratch {
    places: Vec<Place>,
    /// Values of a feature in all samples, the positive ones first, then the weak classifier's answers to them.
    values: Vec<f32>,
    /// Answers of all weak classifiers, one after the other.
    answers: Vec<f32>,
    /// Log odds by what is chosen so far.
    sum: Vec<f32>,
    taken: Vec<bool>,
}

const SEED: u64 = 2011;

impl Mil {
    pub fn new(params: &MilParams, shape: &Shape) -> Self {
        let mut random = SEED;
        let bank = Bank::random(shape, params.features, &mut random);
        let known = Vec::with_capacity(params.features);
        let (chosen, ratios) = (Vec::with_capacity(params.chosen), Vec::with_capacity(params.chosen));
        Self { params: params.clone(), bank, known, chosen, random, ratios, scratch: Scratch::default() }
    }

    /// As it was before it was saved, where that is sound.
    pub fn restored(mut self, shape: &Shape) -> Option<Self> {
        if !self.is_sound(shape) {
            return None;
        }
        self.remake_ratios();
        Some(self)
    }

    fn remake_ratios(&mut self) {
        self.ratios.clear();
        self.ratios.extend(self.chosen.iter().map(|k| LogRatio::new(&self.known[*k].0, &self.known[*k].1)));
    }

    /// The samples of a frame, the positive ones first; how many those are.
    fn sample(&mut self, shape: &Shape, at: Place) -> usize {
        let MilParams { near, far, positives, negatives, .. } = self.params;
        let (random, places) = (&mut self.random, &mut self.scratch.places);
        places.clear();
        for _ in 0..positives {
            let (radius, angle) = (near * unit(random).sqrt(), std::f64::consts::TAU * unit(random));
            places.push(shape.about(at, radius * angle.cos(), radius * angle.sin()));
        }
        let side = shape.windows();
        for _ in 0..negatives {
            // A few draws find one that is far enough.
            let mut place = Place { x: below(random, side), y: below(random, side) };
            for _ in 0..16 {
                if (place.x as f64 - at.x as f64).hypot(place.y as f64 - at.y as f64) >= far {
                    break;
                }
                place = Place { x: below(random, side), y: below(random, side) };
            }
            places.push(place);
        }
        positives
    }

    /// Chooses the weak classifiers, one after the other, each the one that together with those before makes the bags likeliest
    /// (babenko2011, algorithm 2 and eq. 6): the positive bag by the noisy or, each negative window by itself.
    fn choose(&mut self, positives: usize) {
        let Scratch { answers, sum, taken, places, .. } = &mut self.scratch;
        let n = places.len();
        sum.clear();
        sum.resize(n, 0.0);
        taken.clear();
        taken.resize(self.known.len(), false);
        self.chosen.clear();
        for _ in 0..self.params.chosen.min(self.known.len()) {
            let mut best: Option<(usize, f32)> = None;
            for (k, answers) in answers.chunks_exact(n).enumerate().filter(|(k, _)| !taken[*k]) {
                let none = log_none(&sum[..positives], &answers[..positives]);
                // 1 − p of the bag, which may round to 1.
                let bag = (-none.exp()).max(-1.0 + f32::EPSILON).ln_1p();
                let likelihood = bag + log_none(&sum[positives..], &answers[positives..]);
                if best.is_none_or(|(_, most)| likelihood > most) {
                    best = Some((k, likelihood));
                }
            }
            let Some((k, _)) = best else { break };
            taken[k] = true;
            self.chosen.push(k);
            sum.iter_mut().zip(&answers[k * n..]).for_each(|(sum, answer)| *sum += answer);
        }
    }
}

impl Classifier for Mil {
    fn rate(&mut self, canvas: &Canvas, at: Place, out: &mut [f32; LANES]) {
        out.fill(0.0);
        let mut values = [0.0; LANES];
        for (k, ratio) in self.chosen.iter().zip(&self.ratios) {
            self.bank.get(*k).lanes(canvas, at, &mut values);
            ratio.add(&values, out);
        }
        let count = self.chosen.len().max(1) as f32;
        out.iter_mut().for_each(|v| *v /= count);
    }

    fn learn(&mut self, shape: &Shape, canvas: &Canvas, at: Place) {
        let positives = self.sample(shape, at);
        let (is_first, rate) = (self.known.is_empty(), self.params.learning_rate as f32);
        let Scratch { places, values, answers, .. } = &mut self.scratch;
        answers.clear();
        answers.reserve(places.len() * self.bank.len());
        for k in 0..self.bank.len() {
            values.clear();
            values.extend(places.iter().map(|place| self.bank.get(k).value(canvas, *place)));
            let (on, off) = values.split_at(positives);
            let (on, off) = (Normal::of(on.iter().copied()), Normal::of(off.iter().copied()));
            if is_first {
                self.known.push((on, off));
            } else {
                self.known[k].0.blend(&on, rate);
                self.known[k].1.blend(&off, rate);
            }
            let ratio = LogRatio::new(&self.known[k].0, &self.known[k].1);
            answers.extend(values.iter().map(|v| ratio.of(*v)));
        }
        self.choose(positives);
        self.remake_ratios();
    }

    fn is_sound(&self, shape: &Shape) -> bool {
        let count = self.params.features;
        self.params.check_all().is_ok()
            && self.bank.is_sound(shape, count)
            && self.known.len() == count
            && self.known.iter().all(|(p, n)| p.is_sound() && n.is_sound())
            && self.chosen.iter().all(|k| *k < count)
    }
}

impl LocalizerRecipe for MilParams {
    type Localizer = ClassifierLocalizer;

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<ClassifierLocalizer> {
        Ok(ClassifierLocalizer::new(&self.view, &self.score, frame, bbox, |shape| Model::Mil(Mil::new(self, shape))))
    }
}

/// `mil`.
pub fn mil(name: &'static str) -> TrackerRecipe<MilParams> {
    recipe(name, MilParams::default(), PolicyParams::patient())
}

#[cfg(test)]
mod tests {
    use super::super::twins::{canvas, ratings};
    use super::*;

    #[test]
    fn chosen_classifiers_make_the_bags_likeliest() {
        let (shape, canvas) = canvas();
        let params = MilParams { features: 20, chosen: 4, ..MilParams::default() };
        let mut mil = Mil::new(&params, &shape);
        mil.learn(&shape, &canvas, shape.middle());
        // All over again by the definition, in double precision.
        let places = mil.scratch.places.clone();
        let answer = |k: usize, at: Place| {
            let (p, n) = &mil.known[k];
            let log = |d: &Normal, v: f64| {
                -0.5 * f64::from(d.variance).ln() - (v - f64::from(d.mean)).powi(2) / (2.0 * f64::from(d.variance))
            };
            let v = f64::from(mil.bank.get(k).value(&canvas, at));
            log(p, v) - log(n, v)
        };
        let likelihood = |chosen: &[usize]| -> f64 {
            let p = |at: &Place| {
                1.0 / (1.0 + (-chosen.iter().map(|k| answer(*k, *at)).sum::<f64>()).clamp(-8.0, 8.0).exp())
            };
            let none: f64 = places[..45].iter().map(|at| 1.0 - p(at)).product();
            (1.0 - none).ln() + places[45..].iter().map(|at| (1.0 - p(at)).ln()).sum::<f64>()
        };
        for n in 0..params.chosen {
            let before = &mil.chosen[..n];
            let with = |k: usize| likelihood(&[before, &[k]].concat());
            let best = (0..params.features).filter(|k| !before.contains(k)).map(with).fold(f64::MIN, f64::max);
            assert!(with(mil.chosen[n]) > best - 1e-2 * best.abs(), "{n}: {} of {best}", with(mil.chosen[n]));
        }
    }

    #[test]
    fn the_target_is_rated_best() {
        let (shape, canvas) = canvas();
        let mut mil = Mil::new(&MilParams::default(), &shape);
        (0..3).for_each(|_| mil.learn(&shape, &canvas, shape.middle()));
        let (best, _) = ratings(&mut mil, &shape, &canvas);
        let away = (best.x as f64 - shape.middle().x as f64).hypot(best.y as f64 - shape.middle().y as f64);
        assert!(away <= 4.0, "{best:?}");
        assert!(mil.is_sound(&shape));
    }
}
