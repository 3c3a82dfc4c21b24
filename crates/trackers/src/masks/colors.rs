//! Masks by colours, as `GrabCut` makes them (rother2004): two mixtures of Gaussians, of the target's colours and of those about it,
//! and the cheapest cut between them. Beyond the paper: it works on a grid of bounded size, goes on from what it learnt in the frames
//! before, and weighs where in the box the target's pixels were then.

use super::pieces::Pieces;
use super::{ColorsParams, MaskParams, about};
use pursuit_geometry::{BBox, Mask, Size};
use pursuit_imaging::Frame;
use pursuit_tracking::TrackState;
use pursuit_vision::PixelWindow;
use pursuit_vision::color_mixture::ColorMixture;
use pursuit_vision::cut::{GridCut, Neighbor};
use serde::{Deserialize, Serialize};

/// Cells along a side of the shape that is kept, box and slack.
const SHAPE: usize = 32;
/// Costs are whole numbers of this part of a nat.
const UNIT: f32 = 64.0;
/// What colours and place may cost at most, in nats, and what contradicts the box.
const MOST: f32 = 40.0;
const NEVER: i32 = 1 << 17;
/// No place is certain.
const LEAST_CHANCE: f32 = 0.03;
/// Chance of the target at the middle of its box and at its corners, before anything is known of it; and beyond the box.
const MIDDLE: f32 = 0.9;
const CORNER: f32 = 0.35;
const BEYOND: f32 = 0.1;

/// Which pixels have the target's colours, and hang together.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(remote = "ColorSegmenter")]
pub struct ColorSegmenter {
    params: MaskParams,
    /// Colours of the target and of what is about it; `None` before the first look.
    mixtures: Option<(ColorMixture, ColorMixture)>,
    /// How likely each part of box and slack is the target's, row by row.
    shape: Vec<f32>,
    #[serde(skip)]
    scratch: Scratch,
}

pursuit_estimation::checked!(ColorSegmenter);

/// Not state: overwritten at every use.
#[derive(Debug, Clone, Default)]
struct Scratch {
    colors: Vec<[f32; 3]>,
    /// The chance of each cell to be the target's by its place; `None` where it is background for certain.
    chances: Vec<Option<f32>>,
    inside: Vec<bool>,
    cut: GridCut,
    pieces: Pieces,
}

/// How the picture about a box is divided.
#[derive(Debug, Clone, Copy)]
struct Grid {
    window: PixelWindow,
    /// Pixels along a side of a cell.
    step: usize,
    size: Size,
}

impl Grid {
    fn new(window: PixelWindow, cells: usize) -> Self {
        let fits = |step: &usize| window.width.div_ceil(*step) * window.height.div_ceil(*step) <= cells.max(1);
        let step = (1..).find(fits).unwrap_or(1);
        Self { window, step, size: Size::new(window.width.div_ceil(step), window.height.div_ceil(step)) }
    }

    /// The middle of a cell, in pixels of the frame.
    fn center(&self, x: usize, y: usize) -> (f64, f64) {
        let middle = |at: usize, k: usize, side: usize| {
            let from = k * self.step;
            at as f64 + 0.5 * (from + (from + self.step).min(side)) as f64
        };
        (middle(self.window.x, x, self.window.width), middle(self.window.y, y, self.window.height))
    }
}

impl ColorSegmenter {
    /// Learns the target at `bbox`.
    pub(super) fn new(params: &MaskParams, frame: &Frame, bbox: &BBox) -> Self {
        let middle = (SHAPE as f64 - 1.0) / 2.0;
        let half = middle / (1.0 + 2.0 * params.slack);
        let chance = |k: usize| {
            let (u, v) = (((k % SHAPE) as f64 - middle) / half, ((k / SHAPE) as f64 - middle) / half);
            if u.abs() > 1.0 || v.abs() > 1.0 {
                return BEYOND;
            }
            // 1 at the corners.
            let off = ((u * u + v * v) / 2.0) as f32;
            MIDDLE + (CORNER - MIDDLE) * off
        };
        let shape = (0..SHAPE * SHAPE).map(chance).collect();
        let mut new = Self { params: params.clone(), mixtures: None, shape, scratch: Scratch::default() };
        new.look(frame, bbox, TrackState::Tracking);
        new
    }

    /// Forgets the target and learns that at `bbox`.
    pub(super) fn restart(&mut self, frame: &Frame, bbox: &BBox) {
        *self = Self::new(&self.params, frame, bbox);
    }

    fn restored(self) -> Result<Self, &'static str> {
        use pursuit_parameters::Parameters;
        let sound = self.params.check_all().is_ok()
            && self.shape.len() == SHAPE * SHAPE
            && self.shape.iter().all(|p| (0.0..=1.0).contains(p));
        if sound { Ok(self) } else { Err("its mask is out of range") }
    }

    /// The target's pixels; learns them where it is seen for certain.
    pub(super) fn look(&mut self, frame: &Frame, bbox: &BBox, state: TrackState) -> Option<Mask> {
        let params = self.params.colors.clone();
        let window = PixelWindow::of(&about(bbox, params.reach.max(self.params.slack)), frame.size())?;
        let grid = Grid::new(window, params.cells);
        self.sample(frame, &grid);
        self.place(&grid, bbox);
        let first = self.mixtures.is_none();
        let rounds = if first { params.first_rounds } else { params.rounds };
        let (mut inside, mut outside) = self.mixtures.clone().unwrap_or_else(|| self.first_mixtures(&params));
        let rate = if first { 1.0 } else { params.learning_rate };
        for round in 0..rounds {
            self.divide(&grid, &inside, &outside, &params);
            // The last division of a target seen before is only learnt once it is believed.
            if first || round + 1 < rounds {
                self.learn(&mut inside, &mut outside, rate);
            }
        }
        self.scratch.pieces.keep_large(&mut self.scratch.inside, grid.size.width, self.params.least_piece);
        let mask = self.mask(&grid);
        let fill = mask.area() as f64 / bbox.clipped_to(frame.size()).map_or(1.0, |b| b.area()).max(1.0);
        let believed = fill >= self.params.least_fill;
        if first {
            self.mixtures = Some((inside, outside));
        } else if believed && state == TrackState::Tracking {
            self.learn(&mut inside, &mut outside, rate);
            self.mixtures = Some((inside, outside));
        }
        if believed && state == TrackState::Tracking {
            self.learn_shape(&grid, bbox, if first { 0.5 } else { params.shape_rate as f32 });
        }
        believed.then_some(mask)
    }

    /// The mean colour of each cell.
    fn sample(&mut self, frame: &Frame, grid: &Grid) {
        let colors = &mut self.scratch.colors;
        colors.clear();
        let picture = frame.color();
        let PixelWindow { x: left, y: top, width, height } = grid.window;
        for y in (0..height).step_by(grid.step) {
            let rows = y..(y + grid.step).min(height);
            for x in (0..width).step_by(grid.step) {
                let columns = left + x..left + (x + grid.step).min(width);
                let mut sums = [0_u32; 3];
                for row in rows.clone() {
                    for pixel in &picture.row(top + row)[columns.clone()] {
                        sums.iter_mut().zip(pixel).for_each(|(sum, v)| *sum += u32::from(*v));
                    }
                }
                let count = (rows.len() * columns.len()) as f32;
                colors.push(sums.map(|sum| sum as f32 / count));
            }
        }
    }

    /// How likely each cell is the target's by its place in the box.
    fn place(&mut self, grid: &Grid, bbox: &BBox) {
        let slack = about(bbox, self.params.slack);
        let chances = &mut self.scratch.chances;
        chances.clear();
        for y in 0..grid.size.height {
            for x in 0..grid.size.width {
                chances.push(shape_cell(&slack, grid.center(x, y)).map(|at| self.shape[at]));
            }
        }
    }

    /// The colours in the box and about it, before anything is known.
    fn first_mixtures(&self, params: &ColorsParams) -> (ColorMixture, ColorMixture) {
        let Scratch { colors, chances, .. } = &self.scratch;
        // Half and more: the box without its corners.
        let is_inside = |chance: &Option<f32>| chance.is_some_and(|p| p > 0.5);
        let of = |wanted: bool| -> Vec<[f32; 3]> {
            let cells = colors.iter().zip(chances);
            let wanted = cells.filter(|(_, p)| if wanted { is_inside(p) } else { p.is_none_or(|p| p <= BEYOND) });
            wanted.map(|(color, _)| *color).collect()
        };
        let fit = |wanted| ColorMixture::fit(&of(wanted), params.parts, params.noise);
        (fit(true), fit(false))
    }

    /// Divides the cells: eqs. 7 to 11 of the paper, and the chance of each cell by its place.
    fn divide(&mut self, grid: &Grid, inside: &ColorMixture, outside: &ColorMixture, params: &ColorsParams) {
        let Scratch { colors, chances, inside: cells, cut, .. } = &mut self.scratch;
        let (width, height) = (grid.size.width, grid.size.height);
        let weight = params.shape_weight as f32;
        let whole = |cost: f32| (cost.clamp(0.0, MOST) * UNIT) as i32;
        cut.reset(grid.size);
        for (k, (color, chance)) in colors.iter().zip(chances.iter()).enumerate() {
            let (x, y) = (k % width, k / width);
            let Some(chance) = *chance else {
                cut.add(x, y, NEVER, 0);
                continue;
            };
            let p = chance.clamp(LEAST_CHANCE, 1.0 - LEAST_CHANCE);
            let (a, b) = (inside.cost(*color) - weight * p.ln(), outside.cost(*color) - weight * (1.0 - p).ln());
            let least = a.min(b);
            cut.add(x, y, whole(a - least), whole(b - least));
        }
        let off = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f32>();
        let pairs = |x: usize, y: usize| {
            Neighbor::ALL.into_iter().filter_map(move |to| {
                let (nx, ny, distance) = match to {
                    Neighbor::Right => (x + 1, y, 1.0),
                    Neighbor::Below => (x, y + 1, 1.0),
                    Neighbor::BelowRight => (x + 1, y + 1, std::f32::consts::SQRT_2),
                    Neighbor::BelowLeft => (x.checked_sub(1)?, y + 1, std::f32::consts::SQRT_2),
                };
                (nx < width && ny < height).then_some((to, ny * width + nx, distance))
            })
        };
        let (mut sum, mut count) = (0.0_f32, 0.0_f32);
        for y in 0..height {
            for x in 0..width {
                for (_, other, _) in pairs(x, y) {
                    sum += off(colors[y * width + x], colors[other]);
                    count += 1.0;
                }
            }
        }
        // β: twice the mean squared difference takes neighbours e-fold apart.
        let beta = if sum > 0.0 { count / (2.0 * sum) } else { 0.0 };
        for y in 0..height {
            for x in 0..width {
                for (to, other, distance) in pairs(x, y) {
                    let likeness = (-beta * off(colors[y * width + x], colors[other])).exp();
                    cut.join(x, y, to, (params.smoothness as f32 * likeness / distance * UNIT) as i32);
                }
            }
        }
        cut.solve();
        cells.clear();
        cells.extend((0..width * height).map(|k| cut.is_inside(k % width, k / width)));
    }

    fn learn(&self, inside: &mut ColorMixture, outside: &mut ColorMixture, rate: f64) {
        let Scratch { colors, inside: cells, .. } = &self.scratch;
        let of = |wanted: bool| colors.iter().zip(cells).filter(move |(_, c)| **c == wanted).map(|(color, _)| *color);
        inside.learn(of(true), rate);
        outside.learn(of(false), rate);
    }

    /// Learns where in the box the target's pixels are.
    fn learn_shape(&mut self, grid: &Grid, bbox: &BBox, rate: f32) {
        let slack = about(bbox, self.params.slack);
        let PixelWindow { x: left, y: top, .. } = grid.window;
        for (k, chance) in self.shape.iter_mut().enumerate() {
            let along = |at: usize, from: f64, side: f64| from + (at as f64 + 0.5) / SHAPE as f64 * side;
            let x = along(k % SHAPE, slack.left(), slack.width()) - left as f64;
            let y = along(k / SHAPE, slack.top(), slack.height()) - top as f64;
            // What is beyond the picture is not known.
            let cell = |at: f64, side: usize| (at >= 0.0).then(|| at as usize / grid.step).filter(|at| *at < side);
            if let Some((x, y)) = cell(x, grid.size.width).zip(cell(y, grid.size.height)) {
                let now = if self.scratch.inside[y * grid.size.width + x] { 1.0 } else { 0.0 };
                *chance += rate * (now - *chance);
            }
        }
    }

    /// The cells inside as pixels of the frame: set where the cells, interpolated, say more than one half.
    fn mask(&self, grid: &Grid) -> Mask {
        let (cells, size, step) = (&self.scratch.inside, grid.size, grid.step as f64);
        let PixelWindow { x: left, y: top, width, height } = grid.window;
        let value = |x: usize, y: usize| if cells[y * size.width + x] { 1.0 } else { 0.0 };
        // The two cells whose middles a pixel lies between, and how near it is to the second.
        let between = |pixel: usize, side: usize| {
            let at = ((pixel as f64 + 0.5) / step - 0.5).clamp(0.0, side as f64 - 1.0);
            let first = at as usize;
            (first, (first + 1).min(side - 1), at - first as f64)
        };
        let mut mask = Mask::default();
        for y in 0..height {
            let (y0, y1, v) = between(y, size.height);
            let set = |x: usize| {
                let (x0, x1, u) = between(x, size.width);
                let above = (1.0 - u) * value(x0, y0) + u * value(x1, y0);
                let below = (1.0 - u) * value(x0, y1) + u * value(x1, y1);
                (1.0 - v) * above + v * below > 0.5
            };
            mask.extend_row(top + y, left, (0..width).map(set));
        }
        mask
    }
}

/// Which part of the shape a point is in, box and slack; `None` outside.
fn shape_cell(slack: &BBox, (x, y): (f64, f64)) -> Option<usize> {
    let part = |at: f64, from: f64, side: f64| {
        let k = (at - from) / side * SHAPE as f64;
        (k >= 0.0 && k < SHAPE as f64).then_some(k as usize)
    };
    let (x, y) = (part(x, slack.left(), slack.width())?, part(y, slack.top(), slack.height())?);
    Some(y * SHAPE + x)
}
