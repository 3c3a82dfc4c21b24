//! `dlssvm`: a dual linear structured support vector machine on an explicit feature map (ning2016). As [`struck`](super::struck) it ranks
//! displacements by how well the window there overlaps the target; its function is linear, so that it costs the same whatever it has
//! learnt, and each step of its optimisation has a closed form.

mod maps;
mod solver;
#[cfg(test)]
mod tests;

use super::canvas::{Canvas, LANES, Place, Shape};
use super::{Classifier, ClassifierLocalizer, ClassifierScoreParams, Model, ViewParams, recipe};
use crate::correlation::ScaleLadderParams;
use crate::wary::wary;
use maps::{Grid, Maps};
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_parameters::Parameters;
use pursuit_tracking::policy::PolicyParams;
use pursuit_tracking::{LocalizerRecipe, Result, TrackerRecipe};
use serde::{Deserialize, Serialize};

pursuit_parameters::parameters! {
    /// Parameters of the dual linear structured support vector machine.
    pub struct DlssvmParams {
        /// How the target is looked at.
        pub view: ViewParams = ViewParams::default();
        /// Side of the cells of a window; one pixel of each is a feature.
        pub cell_px: usize = 2, in 1..=8, unit "canvas px", source "ours";
        /// Bits of a map's unary code: it has one level more.
        pub bits: usize = 4, in 1..=15, source "ours; ning2016, section 3.3, quantises likewise";
        /// Half the side of the squares in which pixels are ranked.
        pub rank_px: usize = 2, in 1..=7, unit "canvas px", source "ours";
        /// Colours a* and b* are quantised from minus to plus this.
        pub color_span: f64 = 50.0, in 10.0..=110.0, unit "CIE 1976 units", source "ours";
        /// Regularisation C.
        pub c: f64 = 100.0, in above(0.0), source "hare2011, section 4: 100";
        /// Most support vectors.
        pub budget: usize = 100, in 4..=1000, source "ning2016, section 4: 100";
        /// Old frames gone over after each new one.
        pub reprocess: usize = 10, in 0..=100, source "hare2011, section 4: 10";
        /// Passes of coordinate descent over all support vectors after each of those.
        pub passes: usize = 10, in 0..=100, source "hare2011, section 4: 10";
        /// Sizes that are tried.
        pub sizes: ScaleLadderParams = ScaleLadderParams { levels: 1, step: 1.005, penalty: 1.0 };
        /// The score, chosen as `docs/papers/ning2016.md` says.
        pub score: ClassifierScoreParams =
            ClassifierScoreParams { bias: -5.0, rating: 0.0, margin: 1.6, likeness: 0.9, colors: 5.5 };
    }
}

/// The classifier: what it learns from, and how much of each.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Dlssvm {
    pub(super) params: DlssvmParams,
    /// Whether it looks at colour.
    pub(super) colored: bool,
    patterns: Vec<Pattern>,
    vectors: Vec<Vector>,
    random: u64,
    /// Made anew from the above when a state is read.
    #[serde(skip)]
    derived: Option<Derived>,
    #[serde(skip)]
    scratch: Scratch,
}

/// A frame that is learnt from: levels at the pixels of its canvas that windows look at, and the target's window.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
struct Pattern {
    levels: Vec<u16>,
    target: Place,
}

/// A window of a pattern with a dual variable.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Vector {
    pattern: usize,
    window: Place,
    /// Δ: 1 less the overlap with the target.
    loss: f64,
    /// α.
    weight: f64,
    /// w · Ψ, where Ψ is the target's features less the window's.
    #[serde(skip)]
    margin: f64,
}

/// What follows from the patterns and the dual variables.
#[derive(Debug, Clone)]
struct Derived {
    grid: Grid,
    /// Ψ of the support vectors, one after the other.
    rows: Vec<f32>,
    /// Their inner products, as many in a row as there may be support vectors.
    kernel: Vec<f64>,
    /// w = Σ α Ψ, and whether it is that of today's dual variables.
    weights: Vec<f32>,
    is_current: bool,
}

#[derive(Debug, Clone, Default)]
struct Scratch {
    maps: Maps,
    /// Bits of a pattern.
    planes: Vec<f32>,
    window: Vec<f32>,
    row: Vec<f32>,
    spare: Vec<Pattern>,
}

const SEED: u64 = 2016;

impl Dlssvm {
    pub fn new(params: &DlssvmParams, shape: &Shape, colored: bool) -> Self {
        let grid = Grid::new(shape, params, colored);
        let capacity = params.budget + 2;
        let (wide, high) = grid.pixels;
        let spare = || Pattern { levels: Vec::with_capacity(wide * high), target: Place::default() };
        Self {
            params: params.clone(),
            colored,
            patterns: Vec::with_capacity(capacity),
            vectors: Vec::with_capacity(capacity),
            random: SEED,
            derived: Some(Derived::new(grid, capacity)),
            scratch: Scratch { spare: (0..capacity).map(|_| spare()).collect(), ..Scratch::default() },
        }
    }

    /// As it was before it was saved, where that is sound.
    pub fn restored(mut self, shape: &Shape) -> Option<Self> {
        if !self.is_sound(shape) {
            return None;
        }
        self.derive(Grid::new(shape, &self.params, self.colored));
        Some(self)
    }
}

impl Classifier for Dlssvm {
    fn look(&mut self, canvas: &Canvas) {
        let Some(derived) = &mut self.derived else { return };
        self.scratch.maps.look(canvas, &derived.grid, &self.params);
        self.scratch.maps.expand(&derived.grid);
        derived.weigh(&self.vectors);
    }

    fn rate(&mut self, _: &Canvas, at: Place, out: &mut [f32; LANES]) {
        out.fill(0.0);
        if let Some(Derived { grid, weights, .. }) = &self.derived {
            self.scratch.maps.rate(grid, weights, at, out);
        }
    }

    fn learn(&mut self, shape: &Shape, canvas: &Canvas, at: Place) {
        // Taken out, so that both can be changed at once.
        let Some(mut derived) = self.derived.take() else { return };
        // From scratch, so that a state that was saved and read goes on to the last digit as one that was not.
        self.measure_margins(&derived);
        self.process_new(shape, canvas, at, &mut derived);
        for _ in 0..self.params.reprocess {
            if !self.process_old(shape, &mut derived) {
                break;
            }
            (0..self.params.passes).for_each(|_| self.pass(&derived));
            self.tidy(&mut derived);
        }
        derived.is_current = false;
        self.derived = Some(derived);
    }

    fn is_sound(&self, shape: &Shape) -> bool {
        if self.params.check_all().is_err() {
            return false;
        }
        let grid = Grid::new(shape, &self.params, self.colored);
        let (wide, high) = grid.pixels;
        let inside = |p: &Place| p.x < grid.windows && p.y < grid.windows;
        let pattern = |p: &Pattern| {
            p.levels.len() == wide * high && p.levels.iter().all(|l| grid.is_sound(*l)) && inside(&p.target)
        };
        let vector = |v: &Vector| {
            let known = v.pattern < self.patterns.len() && inside(&v.window);
            known && (0.0..=1.0).contains(&v.loss) && (0.0..=self.params.c).contains(&v.weight)
        };
        let budget = self.params.budget;
        self.vectors.len() <= budget
            && self.patterns.len() <= budget
            && self.patterns.iter().all(pattern)
            && self.vectors.iter().all(vector)
    }
}

impl LocalizerRecipe for DlssvmParams {
    type Localizer = ClassifierLocalizer;

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<ClassifierLocalizer> {
        let model = |shape: &Shape| Model::Dlssvm(Box::new(Dlssvm::new(self, shape, frame.has_color())));
        Ok(ClassifierLocalizer::new(&self.view, &self.score, frame, bbox, model).with_sizes(&self.sizes))
    }
}

/// `dlssvm`.
pub fn dlssvm(name: &'static str) -> TrackerRecipe<DlssvmParams> {
    recipe(name, DlssvmParams::default(), wary(PolicyParams::patient()))
}
