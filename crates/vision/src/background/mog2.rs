use super::difference::{Channels, check, check_sizes};
use super::mixture::{MOST, Mixture, Mode, Rule};
use super::{BACKGROUND, BackgroundModel, FOREGROUND, Learning, SHADOW};
use crate::Result;
use crate::error::{VisionError, require_range};
use multiversion::multiversion;
use pursuit_geometry::Size;
use pursuit_imaging::{Image, ImageView};
use serde::{Deserialize, Serialize};
use std::marker::PhantomData;
use std::ops::Range;

/// Parameters of [`Mog2`]; the names of OpenCV's `BackgroundSubtractorMOG2` in parentheses.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Mog2Params {
    /// Frames that the background remembers, ≥ 1 (`history`): where [`Learning::rate`] leaves it to the model, frame n has
    /// the weight 1/min(2n, history).
    pub history_frames: usize,
    /// Most Gaussians a pixel, 1 to 8 (`nmixtures`).
    pub most_modes: usize,
    /// Squared distance from a Gaussian, in variances, below which a value is background (`varThreshold`), > 0.
    pub background_distance: f64,
    /// Squared distance, in variances, below which a value belongs to a Gaussian (`varThresholdGen`), > 0.
    pub match_distance: f64,
    /// The heaviest Gaussians that together weigh this are background, 0 to 1 (`backgroundRatio`).
    pub background_ratio: f64,
    /// Variance of a new Gaussian, codes² (`varInit`), from the least to the greatest.
    pub initial_variance: f64,
    /// Least variance, codes² (`varMin`), > 0.
    pub least_variance: f64,
    /// Greatest variance, codes² (`varMax`).
    pub most_variance: f64,
    /// Prior weight against many Gaussians, 0 to 0.5 (`complexityReductionThreshold`, c_T).
    pub complexity_reduction: f64,
    /// How dark a shadow may be relative to the background, 0 to 1 (`shadowThreshold`, τ); `None`: shadows are foreground.
    /// In grey images everything darkened that little is a shadow.
    pub shadow_ratio: Option<f64>,
}

impl Default for Mog2Params {
    /// OpenCV's.
    fn default() -> Self {
        Self::OPENCV
    }
}

impl Mog2Params {
    /// For a tracker that protects the pixels of what it follows ([`protect_foreground`](super::protect_foreground)):
    /// wider Gaussians, so that light that drifts is background and seldom connected with a target. Without protection
    /// what stands still is background sooner than with OpenCV's values.
    pub const fn protected() -> Self {
        Self { background_distance: 36.0, match_distance: 25.0, ..Self::OPENCV }
    }

    const OPENCV: Self = Self {
        history_frames: 500,
        most_modes: 5,
        background_distance: 16.0,
        match_distance: 9.0,
        background_ratio: 0.9,
        initial_variance: 15.0,
        least_variance: 4.0,
        most_variance: 75.0,
        complexity_reduction: 0.05,
        shadow_ratio: Some(0.5),
    };

    fn check(&self) -> Result<(), VisionError> {
        let positive = (f64::MIN_POSITIVE, f64::from(f32::MAX));
        require_range("history_frames", self.history_frames as f64, (1.0, f64::INFINITY), "at least 1")?;
        require_range("most_modes", self.most_modes as f64, (1.0, MOST as f64), "from 1 to 8")?;
        for (name, value) in [
            ("background_distance", self.background_distance),
            ("match_distance", self.match_distance),
            ("least_variance", self.least_variance),
        ] {
            require_range(name, value, positive, "positive and finite")?;
        }
        let most = (self.least_variance, f64::from(f32::MAX));
        require_range("most_variance", self.most_variance, most, "finite and at least least_variance")?;
        let between = (self.least_variance, self.most_variance);
        require_range("initial_variance", self.initial_variance, between, "from least_variance to most_variance")?;
        require_range("background_ratio", self.background_ratio, (0.0, 1.0), "from 0 to 1")?;
        require_range("complexity_reduction", self.complexity_reduction, (0.0, 0.5), "from 0 to 0.5")?;
        require_range("shadow_ratio", self.shadow_ratio.unwrap_or(0.0), (0.0, 1.0), "from 0 to 1")
    }
}

/// Adaptive mixture of Gaussians for every pixel, as many as it takes (Zivkovic 2004; Zivkovic and van der Heijden 2006),
/// with detection of shadows. The same parameters give the masks of OpenCV's implementation.
///
/// Pixels with a single Gaussian, nearly all, are updated in vectors; the Gaussians after the first lie apart, so that
/// only pixels that have them pay for them. A rate of 0 leaves the model as it is, to the bit.
#[derive(Debug, Clone)]
pub struct Mog2<P> {
    params: Mog2Params,
    frames: usize,
    state: Option<State>,
    pixel: PhantomData<P>,
}

/// Planes of values a pixel: the first Gaussians, and apart from them the others.
#[derive(Debug, Clone)]
struct State {
    size: Size,
    channels: usize,
    counts: Vec<u8>,
    weights: Vec<f32>,
    variances: Vec<f32>,
    means: Vec<Vec<f32>>,
    /// `others` Gaussians a pixel.
    rest: Vec<Mode>,
    others: usize,
    /// One row of the frame, channel by channel.
    line: Vec<f32>,
    /// Which pixels of a row the vectors could not do.
    left_over: Vec<u8>,
}

impl<P: Channels> Mog2<P> {
    /// A model.
    ///
    /// # Errors
    /// When a parameter is out of its range.
    pub fn new(params: Mog2Params) -> Result<Self, VisionError> {
        params.check()?;
        Ok(Self { params, frames: 0, state: None, pixel: PhantomData })
    }

    /// The parameters.
    pub const fn params(&self) -> &Mog2Params {
        &self.params
    }

    fn rule(&self, rate: f64) -> Rule {
        let p = &self.params;
        Rule {
            most_modes: p.most_modes,
            rate: rate as f32,
            prune: (rate * p.complexity_reduction) as f32,
            background_ratio: p.background_ratio as f32,
            background_distance: p.background_distance as f32,
            match_distance: p.match_distance as f32,
            initial_variance: p.initial_variance as f32,
            least_variance: p.least_variance as f32,
            most_variance: p.most_variance as f32,
            shadow_ratio: p.shadow_ratio.map_or(f32::INFINITY, |r| r as f32),
        }
    }

    fn automatic_rate(&self) -> f64 {
        1.0 / (2 * self.frames.max(1)).min(self.params.history_frames) as f64
    }
}

impl<P: Channels> BackgroundModel<P> for Mog2<P> {
    fn apply(&mut self, frame: ImageView<'_, P>, learning: &Learning<'_>, mask: &mut Image<u8>) -> Result<()> {
        check(self.state.as_ref().map(|s| s.size), frame.size(), learning)?;
        mask.resize_for_overwrite(frame.size(), 0)?;
        if self.state.is_some() {
            self.frames += 1;
        }
        let rule = self.rule(learning.rate.unwrap_or_else(|| self.automatic_rate()));
        let Some(state) = &mut self.state else {
            mask.as_mut_slice().fill(BACKGROUND);
            return if learning.rate == Some(0.0) { Ok(()) } else { self.relearn(frame, 1.0, None) };
        };
        for (y, row) in frame.rows().enumerate() {
            let protect = learning.protect.map(|p| p.row(y)).filter(|row| row.iter().any(|&v| v != 0));
            match P::COUNT {
                1 => state.update_row::<1>(y, P::channels(row), &rule, protect, mask.row_mut(y)),
                _ => state.update_row::<3>(y, P::channels(row), &rule, protect, mask.row_mut(y)),
            }
        }
        Ok(())
    }

    /// The mean of the heaviest Gaussian of every pixel.
    fn background(&self, out: &mut Image<P>) -> Result<bool> {
        let Some(state) = &self.state else { return Ok(false) };
        out.resize_for_overwrite(state.size, P::default())?;
        for (c, means) in state.means.iter().enumerate() {
            let channel = P::channels_mut(out.as_mut_slice()).iter_mut().skip(c).step_by(P::COUNT);
            channel.zip(means).for_each(|(v, mean)| *v = (mean + 0.5) as u8);
        }
        Ok(true)
    }

    fn relearn(&mut self, frame: ImageView<'_, P>, gain: f64, keep: Option<ImageView<'_, u8>>) -> Result<()> {
        check_sizes(self.state.as_ref().map(|s| s.size), frame.size(), keep)?;
        let (size, variance) = (frame.size(), self.params.initial_variance as f32);
        let state = self.state.get_or_insert_with(|| State::new(size, P::COUNT, self.params.most_modes));
        for (y, row) in frame.rows().enumerate() {
            state.replace_row(y, P::channels(row), variance, gain as f32, keep.map(|k| k.row(y)));
        }
        self.frames = 1;
        Ok(())
    }
}

impl State {
    fn new(size: Size, channels: usize, most_modes: usize) -> Self {
        let (n, others) = (size.area(), most_modes - 1);
        Self {
            size,
            channels,
            counts: vec![0; n],
            weights: vec![0.0; n],
            variances: vec![0.0; n],
            means: vec![vec![0.0; n]; channels],
            rest: vec![Mode::default(); n * others],
            others,
            line: vec![0.0; channels * size.width],
            left_over: vec![0; size.width],
        }
    }

    fn update_row<const C: usize>(
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
            self.update_only(at, part, rule);
        }
        mask.fill(BACKGROUND);
        for x in 0..width {
            if self.left_over[x] == 0 {
                continue;
            }
            let value: [f32; 3] = std::array::from_fn(|c| if c < C { self.line[c * width + x] } else { 0.0 });
            let learn = rule.rate > 0.0 && protect.is_none_or(|p| p[x] == 0);
            mask[x] = self.judge::<C>(at + x, &value, rule, learn);
        }
    }

    /// Updates those pixels of a part of the row from pixel `row` on whose only Gaussian the value fits, and marks all
    /// others of them in `left_over`.
    ///
    /// The weight of an only Gaussian is 1: before it is divided by itself it is (1 − α) − αc_T + α.
    fn update_only(&mut self, row: usize, part: Range<usize>, rule: &Rule) {
        let near = rule.match_distance.min(rule.background_distance);
        let limits = (near, rule.rate / (1.0 - rule.prune), rule.least_variance, rule.most_variance);
        let (from, to) = (row + part.start, row + part.end);
        let (counts, variances) = (&self.counts[from..to], &mut self.variances[from..to]);
        let left_over = &mut self.left_over[part.clone()];
        let channel = |c: usize| &self.line[c * self.size.width..][part.clone()];
        match self.means.as_mut_slice() {
            [gray] => update_gray(channel(0), counts, variances, &mut gray[from..to], limits, left_over),
            [r, g, b] => {
                let means = [&mut r[from..to], &mut g[from..to], &mut b[from..to]];
                update_color([0, 1, 2].map(channel), counts, variances, means, limits, left_over);
            }
            _ => left_over.fill(1),
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
        let mut total = first;
        let mut k = 1;
        while k < count {
            let weight = (1.0 - rule.rate) * others[k - 1].weight - rule.prune;
            let pruned = weight < rule.prune;
            others[k - 1].weight = if pruned { 0.0 } else { weight };
            total += others[k - 1].weight;
            count -= usize::from(pruned);
            k += 1;
        }
        let scale = if total.abs() > f32::EPSILON { 1.0 / total } else { 0.0 };
        self.weights[pixel] = first * scale;
        others[..count - 1].iter_mut().for_each(|mode| mode.weight *= scale);
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
        }
    }

    fn replace_row(&mut self, y: usize, row: &[u8], variance: f32, gain: f32, keep: Option<&[u8]>) {
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

/// Squared distance that is near (in variances), share of the frame, least and greatest variance.
type Limits = (f32, f32, f32, f32);

#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn update_gray(
    line: &[f32],
    counts: &[u8],
    variances: &mut [f32],
    means: &mut [f32],
    (near, k, least, most): Limits,
    left_over: &mut [u8],
) {
    let n = left_over.len();
    let (line, counts, variances, means) = (&line[..n], &counts[..n], &mut variances[..n], &mut means[..n]);
    for i in 0..n {
        let off = means[i] - line[i];
        let variance = variances[i];
        let simple = (counts[i] == 1) & (off * off < near * variance);
        let k = if simple { k } else { 0.0 };
        means[i] -= k * off;
        let learnt = (variance + k * (off * off - variance)).max(least).min(most);
        variances[i] = if simple { learnt } else { variance };
        left_over[i] = u8::from(!simple);
    }
}

#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn update_color(
    line: [&[f32]; 3],
    counts: &[u8],
    variances: &mut [f32],
    means: [&mut [f32]; 3],
    (near, k, least, most): Limits,
    left_over: &mut [u8],
) {
    let n = left_over.len();
    let [red, green, blue] = line.map(|l| &l[..n]);
    let [mean_red, mean_green, mean_blue] = means.map(|m| &mut m[..n]);
    let (counts, variances) = (&counts[..n], &mut variances[..n]);
    for i in 0..n {
        let (r, g, b) = (mean_red[i] - red[i], mean_green[i] - green[i], mean_blue[i] - blue[i]);
        let distance = r * r + g * g + b * b;
        let variance = variances[i];
        let simple = (counts[i] == 1) & (distance < near * variance);
        let k = if simple { k } else { 0.0 };
        mean_red[i] -= k * r;
        mean_green[i] -= k * g;
        mean_blue[i] -= k * b;
        let learnt = (variance + k * (distance - variance)).max(least).min(most);
        variances[i] = if simple { learnt } else { variance };
        left_over[i] = u8::from(!simple);
    }
}

#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn split_channels<const C: usize>(row: &[u8], line: &mut [f32]) {
    let width = row.len() / C;
    for (c, out) in line.chunks_exact_mut(width).enumerate().take(C) {
        for (out, v) in out.iter_mut().zip(row.chunks_exact(C)) {
            *out = f32::from(v[c]);
        }
    }
}
