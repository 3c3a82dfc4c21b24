//! What is known of every pixel, and what a row of a frame does to it.

use super::kernels::{split_channels, update_pair, update_single};
use crate::background::mixture::{Mixture, Mode, Rule};
use crate::background::{BACKGROUND, FOREGROUND, SHADOW};
use pursuit_geometry::Size;
use std::ops::Range;

/// Planes of values a pixel: the first Gaussians, the weights of the second ones, and apart from them the rest.
#[derive(Debug, Clone)]
pub(super) struct State {
    pub size: Size,
    channels: usize,
    counts: Vec<u8>,
    weights: Vec<f32>,
    /// Weights of the second Gaussians, which `rest` leaves out.
    seconds: Vec<f32>,
    variances: Vec<f32>,
    pub means: Vec<Vec<f32>>,
    /// `others` Gaussians a pixel.
    rest: Vec<Mode>,
    others: usize,
    /// One row of the frame, channel by channel.
    line: Vec<f32>,
    /// Which pixels of a row the vectors could not do.
    left_over: Vec<u8>,
}

/// The planes of a stretch of a row.
pub(super) struct Row<'a, const C: usize> {
    pub counts: &'a mut [u8],
    pub weights: &'a mut [f32],
    pub seconds: &'a mut [f32],
    pub variances: &'a mut [f32],
    pub means: [&'a mut [f32]; C],
}

/// Pixels that are done alike: where each has one Gaussian there is less to read and write.
const STRETCH: usize = 128;
/// Pixels that are passed over together where the vectors did them all.
const GLANCE: usize = 16;

impl State {
    pub fn new(size: Size, channels: usize, most_modes: usize) -> Self {
        let (n, others) = (size.area(), most_modes - 1);
        Self {
            size,
            channels,
            counts: vec![0; n],
            weights: vec![0.0; n],
            seconds: vec![0.0; n],
            variances: vec![0.0; n],
            means: vec![vec![0.0; n]; channels],
            rest: vec![Mode::default(); n * others],
            others,
            line: vec![0.0; channels * size.width],
            left_over: vec![0; size.width],
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
        let at = y * width;
        split_channels::<C>(row, &mut self.line);
        // What lies between protected pixels is done one by one, too.
        let span = protect.and_then(|p| Some(p.iter().position(|&v| v != 0)?..p.iter().rposition(|&v| v != 0)? + 1));
        let span = span.unwrap_or(width..width);
        self.left_over[span.clone()].fill(1);
        for part in [0..span.start, span.end..width] {
            self.update_alike::<C>(at, part, rule);
        }
        mask.fill(BACKGROUND);
        for from in (0..width).step_by(GLANCE) {
            let part = from..width.min(from + GLANCE);
            if self.left_over[part.clone()].iter().all(|v| *v == 0) {
                continue;
            }
            for x in part {
                if self.left_over[x] == 0 {
                    continue;
                }
                let value: [f32; 3] = std::array::from_fn(|c| if c < C { self.line[c * width + x] } else { 0.0 });
                let learn = rule.rate > 0.0 && protect.is_none_or(|p| p[x] == 0);
                mask[x] = self.judge::<C>(at + x, &value, rule, learn);
            }
        }
    }

    /// Updates those pixels of a part of the row from pixel `row` on whose heaviest Gaussian of at most two the value fits, and
    /// marks all others of them in `left_over`.
    fn update_alike<const C: usize>(&mut self, row: usize, part: Range<usize>, rule: &Rule) {
        let Ok(means) = <&mut [Vec<f32>; C]>::try_from(self.means.as_mut_slice()) else { return };
        let mut means = means.each_mut();
        for from in part.clone().step_by(STRETCH) {
            let part = from..part.end.min(from + STRETCH);
            let pixels = row + part.start..row + part.end;
            let mut stretch = Row {
                counts: &mut self.counts[pixels.clone()],
                weights: &mut self.weights[pixels.clone()],
                seconds: &mut self.seconds[pixels.clone()],
                variances: &mut self.variances[pixels.clone()],
                means: means.each_mut().map(|m| &mut m[pixels.clone()]),
            };
            let line = std::array::from_fn(|c| &self.line[c * self.size.width..][part.clone()]);
            let left_over = &mut self.left_over[part];
            // What learns nothing has to stay as it is to the bit: the weights of two are divided by their sum.
            if rule.rate > 0.0 && stretch.counts.iter().any(|c| *c != 1) {
                update_pair::<C>(line, &mut stretch, rule, left_over);
            } else {
                update_single::<C>(line, &mut stretch, rule, left_over);
            }
        }
    }

    /// As [`Mixture::update`] where the heaviest Gaussian fits both ways, in place; `false`, and nothing changed, elsewhere.
    fn update_first(&mut self, pixel: usize, value: &[f32; 3], rule: &Rule) -> bool {
        let mut count = usize::from(self.counts[pixel]);
        let variance = self.variances[pixel];
        let off = |(means, v): (&Vec<f32>, &f32)| (means[pixel] - v).powi(2);
        let distance: f32 = self.means.iter().zip(value).map(off).sum();
        let near = rule.match_distance.min(rule.background_distance);
        if count < 2 || distance >= near * variance || rule.background_ratio <= 0.0 {
            return false;
        }
        let first = (1.0 - rule.rate) * self.weights[pixel] - rule.prune + rule.rate;
        let k = rule.rate / first;
        self.means.iter_mut().zip(value).for_each(|(means, v)| means[pixel] -= k * (means[pixel] - v));
        let learnt = variance + k * (distance - variance);
        self.variances[pixel] = learnt.max(rule.least_variance).min(rule.most_variance);
        let others = &mut self.rest[pixel * self.others..][..count - 1];
        let second = &mut self.seconds[pixel];
        let mut total = first;
        let mut k = 1;
        while k < count {
            let lighter = if k == 1 { &mut *second } else { &mut others[k - 1].weight };
            let weight = (1.0 - rule.rate) * *lighter - rule.prune;
            let pruned = weight < rule.prune;
            *lighter = if pruned { 0.0 } else { weight };
            total += *lighter;
            count -= usize::from(pruned);
            k += 1;
        }
        let scale = if total.abs() > f32::EPSILON { 1.0 / total } else { 0.0 };
        self.weights[pixel] = first * scale;
        *second *= scale;
        others[..count - 1].iter_mut().skip(1).for_each(|mode| mode.weight *= scale);
        self.counts[pixel] = count as u8;
        true
    }

    fn judge<const C: usize>(&mut self, pixel: usize, value: &[f32; 3], rule: &Rule, learn: bool) -> u8 {
        if learn && self.update_first(pixel, value, rule) {
            return BACKGROUND;
        }
        let mut mixture = self.mixture(pixel);
        let background = if learn {
            let background = mixture.update::<C>(value, rule);
            self.store(pixel, &mixture);
            background
        } else {
            mixture.is_background::<C>(value, rule)
        };
        if background {
            BACKGROUND
        } else if rule.shadow_ratio <= 1.0 && mixture.is_shadow::<C>(value, rule) {
            SHADOW
        } else {
            FOREGROUND
        }
    }

    fn mixture(&self, pixel: usize) -> Mixture {
        let mut mixture = Mixture { count: usize::from(self.counts[pixel]), ..Mixture::default() };
        let first = &mut mixture.modes[0];
        (first.weight, first.variance) = (self.weights[pixel], self.variances[pixel]);
        first.mean.iter_mut().zip(&self.means).for_each(|(v, means)| *v = means[pixel]);
        if mixture.count > 1 {
            let others = &self.rest[pixel * self.others..][..mixture.count - 1];
            mixture.modes[1..mixture.count].copy_from_slice(others);
            mixture.modes[1].weight = self.seconds[pixel];
        }
        mixture
    }

    fn store(&mut self, pixel: usize, mixture: &Mixture) {
        self.counts[pixel] = mixture.count as u8;
        let first = &mixture.modes[0];
        (self.weights[pixel], self.variances[pixel]) = (first.weight, first.variance);
        self.means.iter_mut().zip(first.mean).for_each(|(means, v)| means[pixel] = v);
        if mixture.count > 1 {
            let others = &mut self.rest[pixel * self.others..][..mixture.count - 1];
            others.copy_from_slice(&mixture.modes[1..mixture.count]);
            self.seconds[pixel] = mixture.modes[1].weight;
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
                (self.counts[pixel], self.weights[pixel], self.variances[pixel]) = (1, 1.0, variance);
                self.means.iter_mut().zip(value).for_each(|(m, &v)| m[pixel] = f32::from(v));
            }
        }
    }
}
