//! The camera's exposure: one gain and one offset a channel between the background and the frame, told from whatever of the
//! background is in sight.

use super::BackgroundModel;
use super::difference::Channels;
use crate::Result;
use pursuit_imaging::{Image, ImageView};

/// Samples of the picture, about.
const SAMPLES: usize = 8192;
/// Bins an octave of brightness: 1.1 % each.
const BINS_AN_OCTAVE: f32 = 64.0;
/// Octaves to either side.
const OCTAVES: f32 = 3.0;
const BINS: usize = 385;
/// Bins to either side of the peak that belong to it.
const NEAR: usize = 4;
/// Codes from which on a pixel says nothing: too dark to have a ratio, or clipped.
const USABLE: std::ops::RangeInclusive<u8> = 10..=247;
/// Least share of the samples that must agree.
const LEAST_SUPPORT: f32 = 0.25;
/// The gain of the frame before stands where it has this share of the best one's support: a large thing is no other light.
const INERTIA: f32 = 0.7;
/// Gains and offsets (codes) nearer to nothing than these are nothing.
const SMALLEST: (f32, f32) = (0.015, 2.0);
/// Largest offset, codes.
const MOST_OFFSET: f32 = 20.0;

/// Frame = gain · background + offset, of one channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Line {
    pub gain: f32,
    pub offset: f32,
}

const SAME: Line = Line { gain: 1.0, offset: 0.0 };

/// What the exposure is, frame by frame.
#[derive(Debug, Clone)]
pub(super) struct Exposure<P> {
    lines: [Line; 3],
    /// Share of the samples that the lines explain, and that the lines of the frame before explain.
    pub explained: f64,
    pub explained_before: f64,
    samples: Vec<(P, P)>,
    /// The samples of the channel at work that tell a ratio: frame and background.
    channel: Vec<(f32, f32)>,
    histogram: Vec<f32>,
    tables: [[u8; 256]; 3],
}

impl<P: Channels> Exposure<P> {
    pub fn new() -> Self {
        Self {
            lines: [SAME; 3],
            explained: 0.0,
            explained_before: 0.0,
            samples: Vec::with_capacity(2 * SAMPLES),
            channel: Vec::with_capacity(2 * SAMPLES),
            histogram: vec![0.0; BINS],
            tables: [[0; 256]; 3],
        }
    }

    /// The mean gain of the channels.
    pub fn gain(&self) -> f64 {
        let all = &self.lines[..P::COUNT];
        f64::from(all.iter().map(|l| l.gain).sum::<f32>()) / all.len().max(1) as f64
    }

    /// Gain and offset of the brightness, the mean of the channels.
    pub fn mean(&self) -> (f32, f32) {
        let all = &self.lines[..P::COUNT];
        let n = all.len().max(1) as f32;
        (all.iter().map(|l| l.gain).sum::<f32>() / n, all.iter().map(|l| l.offset).sum::<f32>() / n)
    }

    /// Whether the frame has another exposure than the background.
    pub fn differs(&self) -> bool {
        self.lines[..P::COUNT].iter().any(|l| (l.gain - 1.0).abs() > SMALLEST.0 || l.offset.abs() > SMALLEST.1)
    }

    /// Measures the exposure of `frame` against `model`, outside of `protect`. What is not explained well leaves it as it was.
    pub fn measure<M: BackgroundModel<P>>(
        &mut self,
        frame: ImageView<'_, P>,
        model: &M,
        protect: Option<ImageView<'_, u8>>,
    ) {
        let step = ((frame.width() * frame.height()) as f64 / SAMPLES as f64).sqrt().max(1.0) as usize;
        self.samples.clear();
        for y in (step / 2..frame.height()).step_by(step) {
            let (row, held) = (frame.row(y), protect.as_ref().map(|p| p.row(y)));
            for x in (step / 2..frame.width()).step_by(step).filter(|x| held.is_none_or(|h| h[*x] == 0)) {
                let Some(learnt) = model.sample(x, y) else { return };
                self.samples.push((row[x], learnt));
            }
        }
        let before = self.lines;
        let (mut explained, mut explained_before) = (1.0f64, 1.0f64);
        for c in 0..P::COUNT {
            self.take(c);
            let Some((line, support)) = self.line(before[c]) else { return self.lines = before };
            self.lines[c] = line;
            explained = explained.min(f64::from(support));
            explained_before = explained_before.min(f64::from(self.explained_by(before[c])));
        }
        (self.explained, self.explained_before) = (explained, explained_before);
    }

    /// Takes the samples of a channel.
    fn take(&mut self, c: usize) {
        let usable = |(now, was): &(P, P)| {
            let (now, was) = ([*now], [*was]);
            let (now, was) = (P::channels(&now)[c], P::channels(&was)[c]);
            (USABLE.contains(&now) && USABLE.contains(&was)).then(|| (f32::from(now), f32::from(was)))
        };
        self.channel.clear();
        self.channel.extend(self.samples.iter().filter_map(usable));
    }

    /// The line of the channel taken and the share of samples that it explains; `None` where too few agree.
    fn line(&mut self, before: Line) -> Option<(Line, f32)> {
        let mut histogram = std::mem::take(&mut self.histogram);
        histogram.fill(0.0);
        let bin =
            |ratio: f32| ((ratio.log2() + OCTAVES) * BINS_AN_OCTAVE).round().clamp(0.0, (BINS - 1) as f32) as usize;
        for (now, was) in &self.channel {
            histogram[bin(now / was)] += 1.0;
        }
        let count = self.channel.len() as f32;
        let support = |at: usize| histogram[at.saturating_sub(NEAR)..(at + NEAR + 1).min(BINS)].iter().sum::<f32>();
        let best = (0..BINS).max_by(|a, b| support(*a).total_cmp(&support(*b)))?;
        let usual = bin(before.gain);
        let kept = support(usual) >= INERTIA * support(best);
        let near_usual = usual.saturating_sub(2 * NEAR)..(usual + 2 * NEAR + 1).min(BINS);
        let at = if kept { near_usual.max_by(|a, b| support(*a).total_cmp(&support(*b)))? } else { best };
        let enough = count > 0.0 && support(at) >= LEAST_SUPPORT * count;
        self.histogram = histogram;
        if !enough {
            return None;
        }
        let gain = ((at as f32) / BINS_AN_OCTAVE - OCTAVES).exp2();
        let rough = Line { gain, offset: 0.0 };
        let line = self.fitted(rough);
        Some((line, self.explained_by(line)))
    }

    /// The line of least squares through the samples near `rough`.
    fn fitted(&self, rough: Line) -> Line {
        let (mut n, mut x, mut y, mut xx, mut xy) = (0.0f64, 0.0f64, 0.0f64, 0.0f64, 0.0f64);
        for (now, was) in self.channel.iter().filter(|s| rough.explains(**s)) {
            let (now, was) = (f64::from(*now), f64::from(*was));
            (n, x, y, xx, xy) = (n + 1.0, x + was, y + now, xx + was * was, xy + was * now);
        }
        let spread = n * xx - x * x;
        if n < 16.0 || spread <= n * n * 64.0 {
            return rough;
        }
        let gain = (n * xy - x * y) / spread;
        let offset = (y - gain * x) / n;
        let sound = gain.is_finite() && gain > 0.1 && offset.abs() <= f64::from(MOST_OFFSET);
        if sound { Line { gain: gain as f32, offset: offset as f32 } } else { rough }
    }

    fn explained_by(&self, line: Line) -> f32 {
        let near = self.channel.iter().filter(|s| line.explains(**s)).count();
        near as f32 / self.channel.len().max(1) as f32
    }

    /// Writes the frame as it would be in the background's exposure.
    pub fn relight(&mut self, frame: ImageView<'_, P>, relit: &mut Image<P>) -> Result<()> {
        for (table, line) in self.tables.iter_mut().zip(&self.lines) {
            let code = |v: usize| ((v as f32 - line.offset) / line.gain + 0.5).clamp(0.0, 255.0) as u8;
            table.iter_mut().enumerate().for_each(|(v, to)| *to = code(v));
        }
        relit.resize_for_overwrite(frame.size(), P::default())?;
        for (y, row) in frame.rows().enumerate() {
            let (from, to) = (P::channels(row), P::channels_mut(relit.row_mut(y)));
            if P::COUNT == 1 {
                to.iter_mut().zip(from).for_each(|(to, v)| *to = self.tables[0][usize::from(*v)]);
            } else {
                for (to, v) in to.as_chunks_mut::<3>().0.iter_mut().zip(from.as_chunks::<3>().0) {
                    for (c, (to, v)) in to.iter_mut().zip(v).enumerate() {
                        *to = self.tables[c][usize::from(*v)];
                    }
                }
            }
        }
        Ok(())
    }

    /// Whether a pixel is as bright as it can be where the background in this light is as well.
    pub fn clipped(&self, now: P, learnt: P) -> bool {
        let (now, learnt) = ([now], [learnt]);
        let pairs = P::channels(&now).iter().zip(P::channels(&learnt)).zip(&self.lines);
        pairs.into_iter().all(|((now, was), line)| {
            let expected = (f32::from(*was) * line.gain + line.offset).min(255.0);
            (f32::from(*now) - expected).abs() <= 20.0
        })
    }
}

impl Line {
    fn explains(&self, (now, was): (f32, f32)) -> bool {
        let expected = self.gain * was + self.offset;
        (now - expected).abs() <= 4.0 + 0.05 * expected
    }
}
