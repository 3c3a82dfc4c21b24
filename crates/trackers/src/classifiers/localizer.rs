use super::canvas::{Canvas, LANES, Place, Shape, center_of};
use super::{ClassifierScoreParams, Model, ViewParams};
use crate::appearance::{FirstColors, PatchSampler};
use crate::correlation::ScaleLadderParams;
use pursuit_estimation::sigmoid;
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_parameters::Parameters;
use pursuit_tracking::search::inside;
use pursuit_tracking::{Figure, Figures, Localizer, Look, Measurement, Result, Search, ViewSize};
use pursuit_vision::patch::dot;
use serde::{Deserialize, Serialize};

/// Side of the patches that are compared with the first.
const SIDE: usize = 16;
/// Sizes that are tried, relative to the first.
const LEAST_SIZE: f64 = 0.2;
const MOST_SIZE: f64 = 5.0;

/// Where the target is, by a classifier.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(remote = "ClassifierLocalizer")]
pub struct ClassifierLocalizer {
    view: ViewParams,
    shape: Shape,
    score: ClassifierScoreParams,
    model: Model,
    /// Sizes that are tried, and the first, in pixels.
    sizes: ScaleLadderParams,
    first_px: (f64, f64),
    /// The target in the first frame, less its mean and of length one.
    first: Vec<f32>,
    colors: FirstColors,
    #[serde(skip)]
    buffers: Buffers,
}

pursuit_estimation::checked!(ClassifierLocalizer);

impl ClassifierLocalizer {
    fn restored(self) -> Result<Self, &'static str> {
        let Self { view, shape, score, sizes, first_px, model, first, colors, .. } = self;
        let has_size = [first_px.0, first_px.1].iter().all(|v| v.is_finite() && *v > 0.0);
        let whole = first.len() == SIDE * SIDE && first.iter().all(|v| v.is_finite()) && colors.is_sound() && has_size;
        let checked = view.check_all().is_ok() && score.check_all().is_ok() && sizes.check_all().is_ok();
        if !shape.is_sound() || shape.reach != view.reach || !checked || !whole {
            return Err("its view or its first patch is not sound");
        }
        let model = model.restored(&shape).ok_or("its classifier does not fit its view")?;
        let buffers = Buffers { canvas: model.canvas(), ..Buffers::default() };
        Ok(Self { view, shape, score, sizes, first_px, model, first, colors, buffers })
    }
}

/// Overwritten at every use.
#[derive(Debug, Clone, Default)]
struct Buffers {
    canvas: Canvas,
    /// Ratings of all windows, row by row.
    ratings: Vec<f32>,
    sampler: PatchSampler,
    patch: Vec<f32>,
}

pursuit_tracking::figures! {
    /// What a classifier says of a box.
    struct ClassifierFigures {
        /// Its rating of the box.
        rating;
        /// How much more that is than its rating of any window that overlaps the box by less than half.
        margin;
        /// Correlation of the box with the first frame's, −1 to 1.
        likeness;
        /// How alike its colours are to the first frame's, 0 to 1.
        colors;
    }
}

/// What a look saw.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClassifierFinding {
    rating: f64,
}

impl ClassifierFinding {
    /// The classifier's rating of the box.
    pub const fn rating(&self) -> f64 {
        self.rating
    }
}

impl ClassifierLocalizer {
    /// Starts on the target at `bbox` with a classifier that `model` makes.
    pub(super) fn new(
        view: &ViewParams,
        score: &ClassifierScoreParams,
        frame: &Frame,
        bbox: BBox,
        model: impl FnOnce(&Shape) -> Model,
    ) -> Self {
        let shape = Shape::new(view, &bbox);
        let mut model = model(&shape);
        let mut buffers = Buffers { canvas: model.canvas(), ..Buffers::default() };
        buffers.canvas.look(frame, &shape, &bbox);
        model.classifier().learn(&shape, &buffers.canvas, shape.middle());
        let mut first = Vec::new();
        buffers.sampler.normalized(frame.gray(), &bbox, SIDE, &mut first);
        let (sizes, first_px) = (ScaleLadderParams::default(), (bbox.width(), bbox.height()));
        let colors = FirstColors::new(frame, &bbox);
        Self { view: view.clone(), shape, score: score.clone(), sizes, first_px, model, first, colors, buffers }
    }

    /// With sizes that are tried.
    pub(super) fn with_sizes(self, sizes: &ScaleLadderParams) -> Self {
        Self { sizes: sizes.clone(), ..self }
    }

    /// Rates the windows of the canvas; the best of them, and the best of those that overlap it by less than half.
    fn best(&mut self) -> (Place, f32, f32) {
        let Buffers { canvas, ratings, .. } = &mut self.buffers;
        let (side, classifier) = (self.shape.windows(), self.model.classifier());
        classifier.look(canvas);
        ratings.clear();
        ratings.resize(side * side, f32::NEG_INFINITY);
        let mut rate_row = |y: usize, ratings: &mut [f32]| {
            let mut lanes = [0.0; LANES];
            for x in (0..side).step_by(LANES).map(|x| x.min(side - LANES)) {
                classifier.rate(canvas, Place { x, y }, &mut lanes);
                ratings[y * side + x..][..LANES].copy_from_slice(&lanes);
            }
        };
        // Every other row, and those beside the best.
        (0..side).step_by(2).for_each(|y| rate_row(y, ratings));
        let coarse = best_of(ratings, side);
        let y = coarse / side;
        for y in [y.wrapping_sub(1), y + 1].into_iter().filter(|y| *y < side) {
            rate_row(y, ratings);
        }
        let at = best_of(ratings, side);
        let (best, place) = (ratings[at], Place { x: at % side, y: at / side });
        let mut rival = f32::NEG_INFINITY;
        for (y, row) in ratings.chunks_exact(side).enumerate() {
            for (x, rating) in row.iter().enumerate() {
                if *rating > rival && self.shape.overlap(place, Place { x, y }) < 0.5 {
                    rival = *rating;
                }
            }
        }
        (place, best, if rival.is_finite() { rival } else { best })
    }

    /// A box so many steps larger about its middle; none where that is out of proportion to the first.
    fn resized(&self, bbox: &BBox, level: i32) -> Option<BBox> {
        let factor = self.sizes.step.powi(level);
        let relative = factor * (bbox.area() / (self.first_px.0 * self.first_px.1)).sqrt();
        let is_kept = level == 0 || (LEAST_SIZE..=MOST_SIZE).contains(&relative);
        is_kept.then(|| BBox::from_center_size(bbox.center(), factor * bbox.width(), factor * bbox.height()))
    }

    /// The top of a parabola through the ratings beside the best window, where they were rated.
    fn summit(&self, at: Place) -> (f64, f64) {
        let side = self.shape.windows();
        let rating = |x: usize, y: usize| f64::from(self.buffers.ratings[y * side + x]);
        let top = |before: f64, here: f64, after: f64| {
            let curvature = before - 2.0 * here + after;
            let shift = 0.5 * (before - after) / curvature;
            if curvature < 0.0 && shift.is_finite() { shift.clamp(-0.5, 0.5) } else { 0.0 }
        };
        let inner = |v: usize| v > 0 && v + 1 < side;
        let Place { x, y } = at;
        let dx = if inner(x) { top(rating(x - 1, y), rating(x, y), rating(x + 1, y)) } else { 0.0 };
        let dy = if inner(y) { top(rating(x, y - 1), rating(x, y), rating(x, y + 1)) } else { 0.0 };
        (x as f64 + dx, y as f64 + dy)
    }
}

/// The greatest; of several alike the one nearest to the middle: votes are often the same about the target.
fn best_of(ratings: &[f32], side: usize) -> usize {
    let away = |at: usize| (2 * (at % side)).abs_diff(side).pow(2) + (2 * (at / side)).abs_diff(side).pow(2);
    let better = |best: usize, (at, rating): (usize, &f32)| {
        let is_better = *rating > ratings[best] || (*rating == ratings[best] && away(at) < away(best));
        if is_better { at } else { best }
    };
    ratings.iter().enumerate().fold(0, better)
}

impl Localizer for ClassifierLocalizer {
    type Finding = ClassifierFinding;

    const FIGURES: &[&[Figure]] = &[ClassifierFigures::ALL];

    fn locate(&mut self, frame: &Frame, search: &Search) -> Result<Option<(Measurement, ClassifierFinding)>> {
        // Elsewhere the target is looked for at the size it had.
        let levels = if search.look == Look::Near { self.sizes.levels as i32 } else { 0 };
        let mut found: Option<(f64, BBox, f32, f32)> = None;
        for level in std::iter::once(0).chain((1..=levels).flat_map(|k| [-k, k])) {
            let Some(expected) = self.resized(&search.expected, level) else { continue };
            self.buffers.canvas.look(frame, &self.shape, &expected);
            let (place, best, rival) = self.best();
            let penalty = if level == 0 { 1.0 } else { self.sizes.penalty };
            let value = f64::from(best) - (1.0 - penalty) * f64::from(best.abs());
            if best.is_finite() && found.is_none_or(|(known, ..)| value > known) {
                let center = center_of(&self.shape, &expected, self.summit(place));
                found = Some((value, expected.centered_at(center), best, rival));
            }
        }
        let Some((_, mut bbox, best, rival)) = found else { return Ok(None) };
        if search.keep_inside {
            bbox = bbox.centered_at(inside(bbox.center(), frame.size()));
        }
        let Buffers { sampler, patch, .. } = &mut self.buffers;
        sampler.normalized(frame.gray(), &bbox, SIDE, patch);
        let (rating, margin) = (f64::from(best), f64::from(best - rival));
        let likeness = f64::from(dot(patch, &self.first));
        let s = &self.score;
        let colors = self.colors.likeness(frame, &bbox);
        let odds = s.bias + s.rating * rating + s.margin * margin + s.likeness * likeness + s.colors * colors;
        let diagnostics = ClassifierFigures { rating, margin, likeness, colors }.into();
        let measurement = Measurement { diagnostics, ..Measurement::new(bbox, sigmoid(odds)) };
        Ok(Some((measurement, ClassifierFinding { rating })))
    }

    fn adapt(&mut self, frame: &Frame, bbox: BBox, _: &ClassifierFinding) -> Result<()> {
        self.buffers.canvas.look(frame, &self.shape, &bbox);
        self.model.classifier().learn(&self.shape, &self.buffers.canvas, self.shape.middle());
        Ok(())
    }

    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        let (view, score, sizes) = (self.view.clone(), self.score.clone(), self.sizes.clone());
        *self = Self::new(&view, &score, frame, bbox, |shape| self.model.untaught(shape, frame)).with_sizes(&sizes);
        Ok(())
    }

    fn view(&self, expected: &BBox) -> Option<ViewSize> {
        let size = self.shape.size();
        let wide = |side: f64, canvas: usize, target: usize| side * canvas as f64 / target as f64;
        Some(ViewSize {
            width: wide(expected.width(), size.width, self.shape.width),
            height: wide(expected.height(), size.height, self.shape.height),
        })
    }
}
