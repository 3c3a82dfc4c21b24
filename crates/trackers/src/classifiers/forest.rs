//! `online-forest`: online random forests (saffari2009). Trees grow while samples come; one that errs out of its bag is felled and grows anew.

use super::canvas::{Canvas, LANES, Place, Shape};
use super::haar::{Bank, below, unit};
use super::{Classifier, ClassifierLocalizer, ClassifierScoreParams, Model, ViewParams, recipe};
use crate::wary::wary;
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_parameters::Parameters;
use pursuit_tracking::policy::PolicyParams;
use pursuit_tracking::{LocalizerRecipe, Result, TrackerRecipe};
use serde::{Deserialize, Serialize};

pursuit_parameters::parameters! {
    /// Parameters of online random forests.
    pub struct ForestParams {
        /// How the target is looked at.
        pub view: ViewParams = ViewParams::default();
        /// Trees, T.
        pub trees: usize = 50, in 1..=500, source "saffari2009, section 3: 100 for learning, fewer for tracking";
        /// Most decisions between root and leaf.
        pub depth: usize = 5, in 1..=12, source "saffari2009, section 3.2: 5";
        /// Features that tests are drawn from.
        pub features: usize = 250, in 8..=2000, source "ours";
        /// Tests tried at a leaf, N.
        pub tests: usize = 10, in 1..=100, source "saffari2009, section 3: 10";
        /// Samples that a leaf must have seen before it parts, α.
        pub least_samples: f64 = 40.0, in 1.0..=1e6, source "ours";
        /// Least gain of a test, β.
        pub least_gain: f64 = 0.1, in 0.0..=1.0, source "saffari2009, section 3: 0.1";
        /// Trees may be felled once they have seen so many samples, 1 / γ.
        pub least_age: f64 = 400.0, in 1.0..=1e9, source "ours";
        /// A tree that errs no more often than that out of its bag is not felled.
        pub tolerated: f64 = 0.1, in 0.0..=1.0, source "ours: in a video a few errors are the rule";
        /// Share of what a tree said out of its bag that stays with each sample it learns.
        pub forgetting: f64 = 0.99, in above(0.0).at_most(1.0), source "ours";
        /// Windows of the target in a frame.
        pub positives: usize = 8, in 1..=500, source "ours";
        /// Negative windows of a frame.
        pub negatives: usize = 24, in 1..=500, source "ours";
        /// How often the first frame is learnt.
        pub first_rounds: usize = 10, in 1..=1000, source "ours";
        /// The score, fitted as `docs/papers/saffari2009.md` says.
        pub score: ClassifierScoreParams =
            ClassifierScoreParams { bias: -6.7, rating: 0.0, margin: 2.1, likeness: 2.7, colors: 5.4 };
    }
}

/// The classifier.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Forest {
    pub(super) params: ForestParams,
    bank: Bank,
    /// Least and greatest value that each feature had so far: thresholds are drawn between them.
    ranges: Vec<(f32, f32)>,
    trees: Vec<Tree>,
    random: u64,
    is_taught: bool,
    #[serde(skip)]
    scratch: Scratch,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
struct Tree {
    nodes: Vec<Node>,
    /// Tests of the leaves, as many for each, in the order of their slots.
    tests: Vec<Test>,
    age: f64,
    /// Weights of what it said of samples that it did not learn from: right, wrong.
    out_of_bag: (f64, f64),
}

/// A decision, or a leaf with the slot of the tests it may become.
#[derive(Debug, Clone, Serialize, Deserialize)]
enum Node {
    /// Of a feature above the threshold the next node is one farther than of one below.
    Decision {
        feature: usize,
        threshold: f32,
        next: usize,
    },
    Leaf {
        depth: usize,
        seen: Counts,
        slot: usize,
    },
}

/// A test, and what came to lie on each side of it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Test {
    feature: usize,
    threshold: f32,
    below: Counts,
    above: Counts,
}

/// How many samples of the target and of others.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
struct Counts {
    on: f64,
    off: f64,
}

impl Counts {
    fn add(&mut self, is_target: bool, times: f64) {
        *(if is_target { &mut self.on } else { &mut self.off }) += times;
    }

    fn total(&self) -> f64 {
        self.on + self.off
    }

    /// Share of the target: 1/2 where nothing was seen.
    fn share(&self) -> f64 {
        (self.on + 1.0) / (self.total() + 2.0)
    }

    /// The Gini index.
    fn impurity(&self) -> f64 {
        let p = self.on / self.total().max(f64::MIN_POSITIVE);
        2.0 * p * (1.0 - p)
    }

    fn is_sound(&self) -> bool {
        self.on.is_finite() && self.off.is_finite() && self.on >= 0.0 && self.off >= 0.0
    }
}

impl Test {
    /// One at random.
    fn draw(ranges: &[(f32, f32)], random: &mut u64) -> Self {
        let feature = below(random, ranges.len());
        let (least, most) = ranges[feature];
        let threshold = least + unit(random) as f32 * (most - least).max(0.0);
        Self { feature, threshold, below: Counts::default(), above: Counts::default() }
    }

    /// How much purer both sides together are than the leaf (saffari2009, eq. 2).
    fn gain(&self, seen: &Counts) -> f64 {
        let share = |side: &Counts| side.total() / seen.total().max(f64::MIN_POSITIVE) * side.impurity();
        seen.impurity() - share(&self.below) - share(&self.above)
    }
}

#[derive(Debug, Clone, Default)]
struct Scratch {
    samples: Vec<(Place, bool)>,
    values: Vec<f32>,
    lanes: Vec<[f32; LANES]>,
}

const SEED: u64 = 2009;

impl Tree {
    fn new(params: &ForestParams, ranges: &[(f32, f32)], random: &mut u64) -> Self {
        // Room for a tree of the usual depth: it grows without allocation.
        let leaves = 1 << params.depth.min(6);
        let (nodes, tests) = (Vec::with_capacity(2 * leaves), Vec::with_capacity(leaves * params.tests));
        let mut tree = Self { nodes, tests, age: 0.0, out_of_bag: (0.0, 0.0) };
        tree.restart(params, ranges, random);
        tree
    }

    /// Begins anew, as one leaf.
    fn restart(&mut self, params: &ForestParams, ranges: &[(f32, f32)], random: &mut u64) {
        self.nodes.clear();
        self.nodes.push(Node::Leaf { depth: 0, seen: Counts::default(), slot: 0 });
        self.tests.clear();
        self.tests.extend((0..params.tests).map(|_| Test::draw(ranges, random)));
        (self.age, self.out_of_bag) = (0.0, (0.0, 0.0));
    }

    /// The leaf that a sample falls to.
    fn leaf(&self, value: impl Fn(usize) -> f32) -> usize {
        let mut at = 0;
        while let Node::Decision { feature, threshold, next } = &self.nodes[at] {
            at = next + usize::from(value(*feature) > *threshold);
        }
        at
    }

    /// How likely the sample is the target.
    fn share(&self, value: impl Fn(usize) -> f32) -> f64 {
        match &self.nodes[self.leaf(value)] {
            Node::Leaf { seen, .. } => seen.share(),
            Node::Decision { .. } => unreachable!("a leaf was asked for"),
        }
    }
}

impl Forest {
    pub fn new(params: &ForestParams, shape: &Shape) -> Self {
        let mut random = SEED;
        let bank = Bank::random(shape, params.features, &mut random);
        Self {
            params: params.clone(),
            bank,
            ranges: vec![(f32::INFINITY, f32::NEG_INFINITY); params.features],
            trees: Vec::with_capacity(params.trees),
            random,
            is_taught: false,
            scratch: Scratch::default(),
        }
    }

    fn sample(&mut self, shape: &Shape, at: Place) {
        let ForestParams { positives, negatives, .. } = self.params;
        let (random, samples) = (&mut self.random, &mut self.scratch.samples);
        samples.clear();
        for k in 0..positives.max(negatives) {
            if k < positives {
                let (dx, dy) = (below(random, 3) as f64 - 1.0, below(random, 3) as f64 - 1.0);
                samples.push((if k == 0 { at } else { shape.about(at, dx, dy) }, true));
            }
            if k < negatives {
                let mut place = Place { x: below(random, shape.windows()), y: below(random, shape.windows()) };
                for _ in 0..16 {
                    if shape.overlap(place, at) < 0.5 {
                        break;
                    }
                    place = Place { x: below(random, shape.windows()), y: below(random, shape.windows()) };
                }
                samples.push((place, false));
            }
        }
    }
}

/// How often a sample is learnt: Poisson with mean 1 (Oza and Russell 2001), by inversion.
fn poisson(random: &mut u64) -> u32 {
    let (mut product, mut k) = (unit(random), 0);
    while product > (-1.0_f64).exp() && k < 8 {
        product *= unit(random);
        k += 1;
    }
    k
}

impl Forest {
    /// One sample goes to every tree (saffari2009, algorithm 1).
    fn grow(&mut self, is_target: bool) {
        let p = &self.params;
        let values = &self.scratch.values;
        for tree in &mut self.trees {
            let times = poisson(&mut self.random);
            if times == 0 {
                let is_right = (tree.share(|f| values[f]) > 0.5) == is_target;
                let said = if is_right { &mut tree.out_of_bag.0 } else { &mut tree.out_of_bag.1 };
                *said += 1.0;
                let error = tree.out_of_bag.1 / (tree.out_of_bag.0 + tree.out_of_bag.1);
                if tree.age > p.least_age && unit(&mut self.random) < error - p.tolerated {
                    tree.restart(p, &self.ranges, &mut self.random);
                }
                continue;
            }
            tree.age += f64::from(times);
            tree.out_of_bag = (tree.out_of_bag.0 * p.forgetting, tree.out_of_bag.1 * p.forgetting);
            let at = tree.leaf(|f| values[f]);
            let next = tree.nodes.len();
            let Node::Leaf { depth, seen, slot } = &mut tree.nodes[at] else { continue };
            seen.add(is_target, f64::from(times));
            let tried = &mut tree.tests[*slot * p.tests..(*slot + 1) * p.tests];
            for test in tried.iter_mut() {
                let side = if values[test.feature] > test.threshold { &mut test.above } else { &mut test.below };
                side.add(is_target, f64::from(times));
            }
            if *depth >= p.depth || seen.total() < p.least_samples {
                continue;
            }
            let best = tried.iter().max_by(|a, b| a.gain(seen).total_cmp(&b.gain(seen))).copied();
            let Some(best) = best.filter(|test| test.gain(seen) > p.least_gain) else { continue };
            // One side takes the tests' place, the other a new one.
            tried.fill_with(|| Test::draw(&self.ranges, &mut self.random));
            let (depth, slot, new) = (*depth + 1, *slot, tree.tests.len() / p.tests);
            tree.tests.extend((0..p.tests).map(|_| Test::draw(&self.ranges, &mut self.random)));
            tree.nodes[at] = Node::Decision { feature: best.feature, threshold: best.threshold, next };
            tree.nodes.push(Node::Leaf { depth, seen: best.below, slot });
            tree.nodes.push(Node::Leaf { depth, seen: best.above, slot: new });
        }
    }
}

impl Classifier for Forest {
    fn rate(&mut self, canvas: &Canvas, at: Place, out: &mut [f32; LANES]) {
        let lanes = &mut self.scratch.lanes;
        lanes.resize(self.bank.len(), [0.0; LANES]);
        lanes.iter_mut().enumerate().for_each(|(k, lanes)| self.bank.get(k).lanes(canvas, at, lanes));
        let scale = 1.0 / self.trees.len().max(1) as f64;
        for (i, out) in out.iter_mut().enumerate() {
            let sum: f64 = self.trees.iter().map(|tree| tree.share(|f| lanes[f][i])).sum();
            *out = (sum * scale) as f32;
        }
    }

    fn learn(&mut self, shape: &Shape, canvas: &Canvas, at: Place) {
        let is_first = !self.is_taught;
        self.is_taught = true;
        for _ in 0..if is_first { self.params.first_rounds } else { 1 } {
            self.sample(shape, at);
            self.scratch.values.resize(self.bank.len(), 0.0);
            if self.trees.is_empty() {
                for (place, _) in &self.scratch.samples {
                    self.bank.values(canvas, *place, &mut self.scratch.values);
                    for (range, v) in self.ranges.iter_mut().zip(&self.scratch.values) {
                        *range = (range.0.min(*v), range.1.max(*v));
                    }
                }
                let new = |_| Tree::new(&self.params, &self.ranges, &mut self.random);
                self.trees = (0..self.params.trees).map(new).collect();
            }
            for k in 0..self.scratch.samples.len() {
                let (place, is_target) = self.scratch.samples[k];
                self.bank.values(canvas, place, &mut self.scratch.values);
                self.grow(is_target);
            }
        }
    }

    fn is_sound(&self, shape: &Shape) -> bool {
        let p = &self.params;
        let has = |feature: usize, threshold: f32| feature < p.features && threshold.is_finite();
        let test = |t: &Test| has(t.feature, t.threshold) && t.below.is_sound() && t.above.is_sound();
        let node = |(at, node): (usize, &Node), tree: &Tree| match node {
            // Onward only: nothing goes round.
            Node::Decision { feature, threshold, next } => {
                has(*feature, *threshold) && *next > at && *next < tree.nodes.len() - 1
            }
            Node::Leaf { seen, slot, .. } => seen.is_sound() && *slot < tree.tests.len() / p.tests,
        };
        let tree = |t: &Tree| {
            !t.nodes.is_empty() && t.nodes.iter().enumerate().all(|n| node(n, t)) && t.tests.iter().all(test)
        };
        p.check_all().is_ok()
            && self.bank.is_sound(shape, p.features)
            && self.trees.len() == p.trees
            && self.trees.iter().all(tree)
            && self.ranges.len() == p.features
            && self.ranges.iter().all(|r| r.0.is_finite() && r.1.is_finite())
    }
}

impl LocalizerRecipe for ForestParams {
    type Localizer = ClassifierLocalizer;

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<ClassifierLocalizer> {
        let model = |shape: &Shape| Model::Forest(Forest::new(self, shape));
        Ok(ClassifierLocalizer::new(&self.view, &self.score, frame, bbox, model))
    }
}

/// `online-forest`.
pub fn online_forest(name: &'static str) -> TrackerRecipe<ForestParams> {
    recipe(name, ForestParams::default(), wary(PolicyParams::patient()))
}

#[cfg(test)]
mod tests {
    use super::super::twins::{canvas, ratings};
    use super::*;

    #[test]
    fn the_target_is_rated_best_and_trees_stay_low() {
        let (shape, canvas) = canvas();
        let params = ForestParams { trees: 20, ..ForestParams::default() };
        let mut forest = Forest::new(&params, &shape);
        (0..10).for_each(|_| forest.learn(&shape, &canvas, shape.middle()));
        let (best, all) = ratings(&mut forest, &shape, &canvas);
        assert!(all.iter().all(|v| (0.0..=1.0).contains(v)));
        let away = (best.x as f64 - shape.middle().x as f64).hypot(best.y as f64 - shape.middle().y as f64);
        assert!(away <= 6.0, "{best:?}");
        assert!(forest.trees.iter().any(|t| t.nodes.len() > 1), "they grow");
        assert!(forest.trees.iter().all(|t| t.nodes.len() < 1 << (params.depth + 1)));
        assert!(forest.is_sound(&shape));
        let mut broken = forest.clone();
        broken.trees[0].nodes[0] = Node::Decision { feature: 0, threshold: 0.0, next: 0 };
        assert!(!broken.is_sound(&shape), "it would go round for ever");
    }

    #[test]
    fn samples_are_learnt_once_on_average() {
        let mut random = 5;
        let drawn: Vec<u32> = (0..20_000).map(|_| poisson(&mut random)).collect();
        let mean = f64::from(drawn.iter().sum::<u32>()) / 20_000.0;
        assert!((mean - 1.0).abs() < 0.03, "{mean}");
        let none = drawn.iter().filter(|k| **k == 0).count() as f64 / 20_000.0;
        assert!((none - (-1.0_f64).exp()).abs() < 0.02, "{none}");
    }

    #[test]
    fn tests_gain_by_what_they_part() {
        let seen = Counts { on: 10.0, off: 10.0 };
        let half = Counts { on: 5.0, off: 5.0 };
        let parts = |below, above| Test { feature: 0, threshold: 0.0, below, above }.gain(&seen);
        assert!((parts(Counts { on: 10.0, off: 0.0 }, Counts { on: 0.0, off: 10.0 }) - 0.5).abs() < 1e-12);
        assert!(parts(half, half).abs() < 1e-12);
    }
}
