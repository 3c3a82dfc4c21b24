//! Background models of a static camera: what belongs to the scene, and what moves in it.
//!
//! Every model is a [`BackgroundModel`]: it marks each pixel of a frame as background (0), shadow (127, only
//! [`Mog2`]) or foreground (255), then learns. [`Learning`] says how fast, and which pixels must not be learnt because a
//! tracked target covers them. [`Watched`] adds what every model needs: a step of the light is noticed, said, and the
//! background learnt anew.

mod average;
mod difference;
mod exposure;
mod fixed;
mod lighting;
mod median;
mod mixture;
mod mog2;
mod noise;
mod registration;
mod three_frame;

pub use average::{RunningAverage, RunningAverageParams};
pub use difference::Channels;
pub use fixed::FixedBackground;
pub use lighting::{LightingParams, LightingStep, Report, Watched};
pub use median::{TemporalMedian, TemporalMedianParams};
pub use mog2::{Mog2, Mog2Params};
pub use three_frame::ThreeFrame;

use crate::{Result, window::PixelWindow};
use pursuit_geometry::{BBox, Size};
use pursuit_imaging::{Image, ImageView};

/// Mask code of the background.
pub const BACKGROUND: u8 = 0;
/// Mask code of a shadow on the background.
pub const SHADOW: u8 = 127;
/// Mask code of the foreground.
pub const FOREGROUND: u8 = 255;

/// What a model may learn from a frame.
#[derive(Debug, Clone, Copy, Default)]
pub struct Learning<'a> {
    /// Weight of this frame, 0 to 1: 0 learns nothing at all, `None` leaves it to the model. See [`learning_rate`].
    pub rate: Option<f64>,
    /// Where this mask is not 0, nothing is learnt; it is as large as the frame. See [`protect_boxes`].
    pub protect: Option<ImageView<'a, u8>>,
}

/// A model of the background in frames of pixels `P`.
///
/// The first frame with a rate other than 0 sets the size and is learnt whole, protected or not, for there is nothing else
/// yet; until then everything is background.
pub trait BackgroundModel<P: Channels> {
    /// Writes what is foreground in `frame` to `mask`, then learns.
    ///
    /// # Errors
    /// When the frame or the protecting mask has another size than the first frame, or the rate is not within 0 to 1;
    /// the model is then left as it was.
    fn apply(&mut self, frame: ImageView<'_, P>, learning: &Learning<'_>, mask: &mut Image<u8>) -> Result<()>;

    /// Writes the most probable background to `out`; `false`, and nothing written, when nothing was learnt yet.
    ///
    /// # Errors
    /// Never for a model that learnt a frame.
    fn background(&self, out: &mut Image<P>) -> Result<bool>;

    /// The same of the pixels inside of `windows` alone, where that saves the model any work; what `out` holds elsewhere means nothing.
    ///
    /// # Errors
    /// As [`background`](Self::background).
    fn background_in(&self, windows: &[PixelWindow], out: &mut Image<P>) -> Result<bool> {
        let _ = windows;
        self.background(out)
    }

    /// The most probable background of one pixel; `None` when nothing was learnt yet, and outside of the picture.
    fn sample(&self, x: usize, y: usize) -> Option<P>;

    /// Forgets the background and takes `frame` for it, except where `keep` is not 0: there the old background
    /// stays, its brightness multiplied by `gain`.
    ///
    /// # Errors
    /// As [`apply`](Self::apply).
    fn relearn(&mut self, frame: ImageView<'_, P>, gain: f64, keep: Option<ImageView<'_, u8>>) -> Result<()>;
}

impl<P: Channels, M: BackgroundModel<P> + ?Sized> BackgroundModel<P> for Box<M> {
    fn apply(&mut self, frame: ImageView<'_, P>, learning: &Learning<'_>, mask: &mut Image<u8>) -> Result<()> {
        (**self).apply(frame, learning, mask)
    }

    fn background(&self, out: &mut Image<P>) -> Result<bool> {
        (**self).background(out)
    }

    fn background_in(&self, windows: &[PixelWindow], out: &mut Image<P>) -> Result<bool> {
        (**self).background_in(windows, out)
    }

    fn sample(&self, x: usize, y: usize) -> Option<P> {
        (**self).sample(x, y)
    }

    fn relearn(&mut self, frame: ImageView<'_, P>, gain: f64, keep: Option<ImageView<'_, u8>>) -> Result<()> {
        (**self).relearn(frame, gain, keep)
    }
}

/// The rate that forgets with time constant `time_constant_s`, after `dt_s` seconds: 1 − exp(−dt/τ).
pub fn learning_rate(dt_s: f64, time_constant_s: f64) -> f64 {
    if dt_s > 0.0 && time_constant_s > 0.0 { -(-dt_s / time_constant_s).exp_m1() } else { 0.0 }
}

/// Makes `mask` an image of `size` that is 255 on every pixel that one of `boxes` touches, else 0.
///
/// # Errors
/// When a side is 0 or too long.
pub fn protect_boxes(size: Size, boxes: &[BBox], mask: &mut Image<u8>) -> Result<()> {
    mask.resize_for_overwrite(size, 0)?;
    mask.as_mut_slice().fill(0);
    for window in boxes.iter().filter_map(|b| PixelWindow::of(b, size)) {
        for y in window.y..window.y + window.height {
            mask.row_mut(y)[window.x..window.x + window.width].fill(255);
        }
    }
    Ok(())
}

/// As [`protect_boxes`], but only the foreground of `mask` in the boxes is marked: the pixels of targets, not the background
/// about them, which must go on being learnt. Else whatever the light changes there stays foreground for good, joins the
/// target, and its box grows.
///
/// # Errors
/// When a side of `mask` is 0 or too long.
pub fn protect_foreground(mask: ImageView<'_, u8>, boxes: &[BBox], protect: &mut Image<u8>) -> Result<()> {
    protect_boxes(mask.size(), boxes, protect)?;
    for (y, row) in mask.rows().enumerate() {
        // Every pixel is written, which is quicker than to choose.
        protect.row_mut(y).iter_mut().zip(row).for_each(|(p, v)| *p = if *v == FOREGROUND { *p } else { 0 });
    }
    Ok(())
}

#[cfg(test)]
mod tests;
