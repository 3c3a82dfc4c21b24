use super::difference::{Channels, check, check_sizes, mark_changed};
use super::{BackgroundModel, Learning};
use crate::Result;
use crate::error::{VisionError, require_range};
use multiversion::multiversion;
use pursuit_imaging::{Image, ImageView};
use serde::{Deserialize, Serialize};

/// Parameters of [`RunningAverage`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RunningAverageParams {
    /// Weight of a frame where [`Learning::rate`] leaves it to the model, 0 to 1.
    pub rate: f64,
    /// A channel that differs by more than this is foreground, codes.
    pub threshold: u8,
    /// Whether foreground is learnt as well; if not, what stops stays foreground for ever.
    pub learn_foreground: bool,
}

impl Default for RunningAverageParams {
    fn default() -> Self {
        Self { rate: 0.01, threshold: 25, learn_foreground: true }
    }
}

/// Difference to a running average: B ← B + α·(I − B).
#[derive(Debug, Clone)]
pub struct RunningAverage<P> {
    params: RunningAverageParams,
    state: Option<State<P>>,
}

#[derive(Debug, Clone)]
struct State<P> {
    /// The average, channel by channel.
    mean: Vec<f32>,
    /// The average, rounded.
    background: Image<P>,
    /// The weight of the frame for every pixel of a row.
    rates: Vec<f32>,
}

impl<P: Channels> RunningAverage<P> {
    /// A model.
    ///
    /// # Errors
    /// When the rate is not within 0 to 1.
    pub fn new(params: RunningAverageParams) -> Result<Self, VisionError> {
        require_range("the learning rate", params.rate, (0.0, 1.0), "from 0 to 1")?;
        Ok(Self { params, state: None })
    }
}

impl<P: Channels> State<P> {
    fn new(frame: ImageView<'_, P>) -> Self {
        let background = frame.to_image();
        let mean = P::channels(background.as_slice()).iter().map(|&v| f32::from(v)).collect();
        Self { mean, background, rates: vec![0.0; frame.width()] }
    }
}

impl<P: Channels> BackgroundModel<P> for RunningAverage<P> {
    fn apply(&mut self, frame: ImageView<'_, P>, learning: &Learning<'_>, mask: &mut Image<u8>) -> Result<()> {
        let known = self.state.as_ref().map(|s| s.background.size());
        check(known, frame.size(), learning)?;
        mask.resize_for_overwrite(frame.size(), 0)?;
        let rate = learning.rate.unwrap_or(self.params.rate) as f32;
        if self.state.is_none() && rate == 0.0 {
            mask.as_mut_slice().fill(0);
            return Ok(());
        }
        let state = self.state.get_or_insert_with(|| State::new(frame));
        let length = frame.width() * P::COUNT;
        for (y, row) in frame.rows().enumerate() {
            let background = state.background.row_mut(y);
            mark_changed(row, background, self.params.threshold, mask.row_mut(y));
            if rate == 0.0 {
                continue;
            }
            state.rates.fill(rate);
            let withhold = |rates: &mut [f32], by: &[u8]| {
                rates.iter_mut().zip(by).filter(|(_, by)| **by != 0).for_each(|(rate, _)| *rate = 0.0);
            };
            if let Some(protect) = learning.protect {
                withhold(&mut state.rates, protect.row(y));
            }
            if !self.params.learn_foreground {
                withhold(&mut state.rates, mask.row(y));
            }
            let mean = &mut state.mean[y * length..][..length];
            match P::COUNT {
                1 => blend::<1>(P::channels(row), &state.rates, mean, P::channels_mut(background)),
                _ => blend::<3>(P::channels(row), &state.rates, mean, P::channels_mut(background)),
            }
        }
        Ok(())
    }

    fn background(&self, out: &mut Image<P>) -> Result<bool> {
        super::fixed::copy(self.state.as_ref().map(|s| &s.background), out)
    }

    fn sample(&self, x: usize, y: usize) -> Option<P> {
        super::fixed::sample(self.state.as_ref().map(|s| &s.background), x, y)
    }

    fn relearn(&mut self, frame: ImageView<'_, P>, gain: f64, keep: Option<ImageView<'_, u8>>) -> Result<()> {
        check_sizes(self.state.as_ref().map(|s| s.background.size()), frame.size(), keep)?;
        let state = self.state.get_or_insert_with(|| State::new(frame));
        for (y, row) in frame.rows().enumerate() {
            super::difference::replace_unless(state.background.row_mut(y), row, gain, keep.map(|k| k.row(y)));
        }
        let rounded = P::channels(state.background.as_slice());
        state.mean.iter_mut().zip(rounded).for_each(|(mean, &v)| *mean = f32::from(v));
        Ok(())
    }
}

#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn blend<const N: usize>(row: &[u8], rates: &[f32], mean: &mut [f32], rounded: &mut [u8]) {
    let pixels = row.chunks_exact(N).zip(mean.chunks_exact_mut(N)).zip(rounded.chunks_exact_mut(N));
    for (((v, mean), rounded), &rate) in pixels.zip(rates) {
        for c in 0..N {
            mean[c] += rate * (f32::from(v[c]) - mean[c]);
            rounded[c] = (mean[c] + 0.5) as u8;
        }
    }
}
