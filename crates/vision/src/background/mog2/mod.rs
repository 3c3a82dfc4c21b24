mod kernels;
mod params;
mod state;

pub use params::Mog2Params;

use super::difference::{Channels, check, check_sizes};
use super::mixture::Rule;
use super::{BACKGROUND, BackgroundModel, Learning};
use crate::Result;
use crate::error::VisionError;
use crate::window::PixelWindow;
use kernels::join_channels;
use pursuit_imaging::{Image, ImageView};
use state::State;
use std::marker::PhantomData;

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
        self.background_in(&[PixelWindow::full(state.size)], out)
    }

    fn background_in(&self, windows: &[PixelWindow], out: &mut Image<P>) -> Result<bool> {
        let Some(state) = &self.state else { return Ok(false) };
        out.resize_for_overwrite(state.size, P::default())?;
        let all = PixelWindow::full(state.size);
        for window in windows.iter().filter_map(|w| w.intersection(&all)) {
            for y in window.y..window.y + window.height {
                let from = y * state.size.width + window.x;
                let columns = from..from + window.width;
                let out = P::channels_mut(&mut out.row_mut(y)[window.x..window.x + window.width]);
                match state.means.as_slice() {
                    [gray] => join_channels([&gray[columns]], out),
                    [r, g, b] => join_channels([&r[columns.clone()], &g[columns.clone()], &b[columns]], out),
                    _ => return Ok(false),
                }
            }
        }
        Ok(true)
    }

    fn sample(&self, x: usize, y: usize) -> Option<P> {
        let state = self.state.as_ref().filter(|s| x < s.size.width && y < s.size.height)?;
        let mut pixel = [P::default()];
        let means = state.means.iter().map(|m| m.get(y * state.size.width + x).copied().unwrap_or(0.0));
        P::channels_mut(&mut pixel).iter_mut().zip(means).for_each(|(v, mean)| *v = (mean + 0.5) as u8);
        Some(pixel[0])
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
