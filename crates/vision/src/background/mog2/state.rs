//! What is known of every pixel, and what a row of a frame does to it.

use super::kernels::{STRETCH, split_channels, update_several, update_single};
use crate::background::mixture::{MOST, Mixture, Mode, Rule};
use crate::background::{BACKGROUND, FOREGROUND, SHADOW};
use pursuit_geometry::Size;

/// Planes of values a pixel: the weights of all Gaussians, the heaviest ones, and apart from them the others.
#[derive(Debug, Clone)]
pub(super) struct State {
    pub size: Size,
    channels: usize,
    counts: Vec<u8>,
    /// A plane for the heaviest Gaussians, one for the next, and so on.
    weights: Vec<Vec<f32>>,
    variances: Vec<f32>,
    pub means: Vec<Vec<f32>>,
    /// The other Gaussians, `others` a pixel.
    rest: Vec<Shape>,
    others: usize,
    /// One row of the frame, channel by channel.
    line: Vec<f32>,
    /// Which pixels of a row the vectors could not do.
    left_over: Vec<u8>,
    /// Those, by their columns.
    picked: Vec<u32>,
    /// The pixel at work.
    mixture: Mixture,
}

/// A Gaussian without its weight.
#[derive(Debug, Clone, Copy, Default)]
struct Shape {
    variance: f32,
    mean: [f32; 3],
}

/// The planes of a stretch of a row, but for the weights.
pub(super) struct Row<'a, const C: usize> {
    pub counts: &'a mut [u8],
    pub variances: &'a mut [f32],
    pub means: [&'a mut [f32]; C],
}

/// Pixels that are passed over together where the vectors did them all.
const GLANCE: usize = 16;
/// Nothing is held.
const FREE: [u8; STRETCH] = [0; STRETCH];

impl State {
    pub fn new(size: Size, channels: usize, most_modes: usize) -> Self {
        let (n, others) = (size.area(), most_modes - 1);
        Self {
            size,
            channels,
            counts: vec![0; n],
            weights: vec![vec![0.0; n]; most_modes],
            variances: vec![0.0; n],
            means: vec![vec![0.0; n]; channels],
            rest: vec![Shape::default(); n * others],
            others,
            line: vec![0.0; channels * size.width],
            left_over: vec![0; size.width],
            picked: Vec::with_capacity(size.width),
            mixture: Mixture::default(),
        }
    }

    pub fn update_row<const C: usize>(
        &mut self,
        y: usize,
        row: &[u8],
        rule: &Rule,
        protect: Option<&[u8]>,
        mask: &mut [u8],
    ) {
        let width = self.size.width;
        split_channels::<C>(row, &mut self.line);
        if rule.background_ratio > 0.0 {
            self.update_alike::<C>(y * width, rule, protect);
        } else {
            // Nothing is background, whatever it fits.
            self.left_over.fill(1);
        }
        mask.fill(BACKGROUND);
        let mut picked = std::mem::take(&mut self.picked);
        self.pick(y * width, &mut picked);
        for x in picked.iter().map(|x| *x as usize) {
            let value: [f32; 3] = std::array::from_fn(|c| if c < C { self.line[c * width + x] } else { 0.0 });
            let learn = rule.rate > 0.0 && protect.is_none_or(|p| p[x] == 0);
            mask[x] = self.judge::<C>(y * width + x, &value, rule, learn);
        }
        self.picked = picked;
    }

    /// The pixels left over of the row that begins at pixel `row`.
    fn pick(&self, row: usize, picked: &mut Vec<u32>) {
        picked.clear();
        for (k, part) in self.left_over.chunks(GLANCE).enumerate() {
            if part.iter().any(|v| *v != 0) {
                let left = part.iter().enumerate().filter(|(_, v)| **v != 0);
                picked.extend(left.map(|(i, _)| (k * GLANCE + i) as u32));
            }
        }
        // What is known of them lies scattered: asked for all at once it comes all at once, one by one each is waited for.
        let known = picked.iter().filter_map(|x| self.rest.get((row + *x as usize) * self.others));
        std::hint::black_box(known.map(|shape| shape.variance).sum::<f32>());
    }

    /// Updates those pixels of the row that begins at pixel `row` whose heaviest Gaussian the value fits, and marks all others in
    /// `left_over`.
    fn update_alike<const C: usize>(&mut self, row: usize, rule: &Rule, protect: Option<&[u8]>) {
        let width = self.size.width;
        let Ok(means) = <&mut [Vec<f32>; C]>::try_from(self.means.as_mut_slice()) else { return };
        let mut means = means.each_mut();
        for from in (0..width).step_by(STRETCH) {
            let part = from..width.min(from + STRETCH);
            let pixels = row + part.start..row + part.end;
            let mut stretch = Row {
                counts: &mut self.counts[pixels.clone()],
                variances: &mut self.variances[pixels.clone()],
                means: means.each_mut().map(|m| &mut m[pixels.clone()]),
            };
            let line = std::array::from_fn(|c| &self.line[c * width..][part.clone()]);
            let left_over = &mut self.left_over[part.clone()];
            let held = protect.map_or(&FREE[..part.len()], |p| &p[part]);
            let most = stretch.counts.iter().copied().max().map_or(0, usize::from);
            // What learns nothing has to stay as it is to the bit: the weights of several are divided by their sum.
            if rule.rate > 0.0 && (most > 1 || held.iter().any(|h| *h != 0)) {
                let mut planes: [&mut [f32]; MOST] = Default::default();
                let weights = self.weights.iter_mut().take(most.max(1));
                planes.iter_mut().zip(weights).for_each(|(plane, all)| *plane = &mut all[pixels.clone()]);
                update_several::<C>(line, &mut stretch, &mut planes[..most.max(1)], rule, held, left_over);
            } else {
                update_single::<C>(line, &mut stretch, rule, left_over);
            }
        }
    }

    fn judge<const C: usize>(&mut self, pixel: usize, value: &[f32; 3], rule: &Rule, learn: bool) -> u8 {
        self.fetch(pixel);
        let background = if learn {
            let background = self.mixture.update::<C>(value, rule);
            self.store(pixel);
            background
        } else {
            self.mixture.is_background::<C>(value, rule)
        };
        if background {
            BACKGROUND
        } else if rule.shadow_ratio <= 1.0 && self.mixture.is_shadow::<C>(value, rule) {
            SHADOW
        } else {
            FOREGROUND
        }
    }

    fn fetch(&mut self, pixel: usize) {
        let mixture = &mut self.mixture;
        mixture.count = usize::from(self.counts[pixel]);
        let first = &mut mixture.modes[0];
        (first.weight, first.variance) = (self.weights[0][pixel], self.variances[pixel]);
        first.mean.iter_mut().zip(&self.means).for_each(|(v, means)| *v = means[pixel]);
        if mixture.count > 1 {
            let others = &self.rest[pixel * self.others..][..mixture.count - 1];
            for ((mode, shape), weights) in mixture.modes[1..].iter_mut().zip(others).zip(&self.weights[1..]) {
                *mode = Mode { weight: weights[pixel], variance: shape.variance, mean: shape.mean };
            }
        }
    }

    fn store(&mut self, pixel: usize) {
        let mixture = &self.mixture;
        self.counts[pixel] = mixture.count as u8;
        let first = &mixture.modes[0];
        (self.weights[0][pixel], self.variances[pixel]) = (first.weight, first.variance);
        self.means.iter_mut().zip(first.mean).for_each(|(means, v)| means[pixel] = v);
        if mixture.count > 1 {
            let others = &mut self.rest[pixel * self.others..][..mixture.count - 1];
            for ((mode, shape), weights) in mixture.modes[1..].iter().zip(others).zip(&mut self.weights[1..]) {
                *shape = Shape { variance: mode.variance, mean: mode.mean };
                weights[pixel] = mode.weight;
            }
        }
    }

    pub fn replace_row(&mut self, y: usize, row: &[u8], variance: f32, gain: f32, keep: Option<&[u8]>) {
        for (x, value) in row.chunks_exact(self.channels).enumerate() {
            let pixel = y * self.size.width + x;
            let kept = keep.is_some_and(|k| k[x] != 0) && self.counts[pixel] > 0;
            if kept {
                self.means.iter_mut().for_each(|m| m[pixel] = (m[pixel] * gain).min(255.0));
                for mode in &mut self.rest[pixel * self.others..(pixel + 1) * self.others] {
                    mode.mean.iter_mut().for_each(|m| *m = (*m * gain).min(255.0));
                }
            } else {
                (self.counts[pixel], self.weights[0][pixel], self.variances[pixel]) = (1, 1.0, variance);
                self.means.iter_mut().zip(value).for_each(|(m, &v)| m[pixel] = f32::from(v));
            }
        }
    }
}
