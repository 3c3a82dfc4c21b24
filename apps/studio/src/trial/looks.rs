//! What the monitor shows of a frame: the picture, its depth, or what moves in it.

use super::run_up::RunUp;
use crate::error::Refusal;
use pursuit::Frame;
use pursuit::imaging::{Image, ImageView, Rgb8};
use pursuit::revise::Frames;
use pursuit::vision::background::{BACKGROUND, BackgroundModel, FOREGROUND, Learning, Mog2, Mog2Params};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// What is nearer or farther than these quantiles of the depths has the first or the last colour.
const QUANTILES: (f64, f64) = (0.02, 0.98);
/// A pixel without depth.
const UNKNOWN: Rgb8 = [0, 0, 0];
/// What a shadow is painted in.
const SHADE: u8 = 110;

/// One way to look at a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Look {
    #[default]
    Picture,
    /// In false colours: near is red, far is blue.
    Depth,
    /// What stands out of the background, by the model that detects motion.
    Foreground,
}

impl Look {
    /// Those that there are of such frames.
    pub fn of(frame: &Frame) -> Vec<Self> {
        let depth = frame.depth_mm().map(|_| Self::Depth);
        [Some(Self::Picture), depth, Some(Self::Foreground)].into_iter().flatten().collect()
    }
}

/// Looks at frames in one way, in any order.
#[derive(Default)]
pub(crate) struct Looks {
    pub look: Look,
    model: Option<Mog2<u8>>,
    mask: Option<Image<u8>>,
    /// The frame that the model was shown last.
    learnt: Option<u64>,
    /// What was made last, of which frame.
    made: Option<(Look, u64, Arc<Frame>)>,
}

impl Looks {
    /// The frame as it is looked at, of the same size.
    ///
    /// # Errors
    /// An input that cannot be read again, pictures of changing size.
    pub fn at(&mut self, frame: &Arc<Frame>, pictures: &mut Frames) -> Result<Arc<Frame>, Refusal> {
        let index = frame.index();
        if let Some((look, made_of, made)) = &self.made
            && (*look, *made_of) == (self.look, index)
        {
            return Ok(made.clone());
        }
        let image = match (self.look, frame.depth_mm()) {
            (Look::Depth, Some(depth)) => false_colors(depth)?,
            (Look::Foreground, _) => self.foreground(frame, pictures)?,
            _ => return Ok(frame.clone()),
        };
        let made = Arc::new(Frame::new(index, frame.time_s(), image));
        self.made = Some((self.look, index, made.clone()));
        Ok(made)
    }

    fn foreground(&mut self, frame: &Frame, pictures: &mut Frames) -> Result<Image<Rgb8>, Refusal> {
        let at = frame.index();
        let next = match RunUp::to(at, self.learnt.take()) {
            RunUp::GoOn(next) => next,
            RunUp::Anew(first) => {
                self.model = None;
                first
            }
        };
        for before in next..at {
            if let Some(frame) = pictures.get(before)? {
                self.learn(&frame.undecorated())?;
            }
        }
        // Planes derived for this alone are not kept.
        let frame = frame.undecorated();
        self.learn(&frame)?;
        self.learnt = Some(at);
        let mut image = Image::filled(frame.size().width, frame.size().height, [0; 3]).map_err(unfit)?;
        let mask = self.mask.iter().flat_map(|mask| mask.as_slice());
        for (out, code) in image.as_mut_slice().iter_mut().zip(mask) {
            *out = match *code {
                FOREGROUND => [255; 3],
                BACKGROUND => [0; 3],
                _ => [SHADE; 3],
            };
        }
        Ok(image)
    }

    fn learn(&mut self, frame: &Frame) -> Result<(), Refusal> {
        let model = match &mut self.model {
            Some(model) => model,
            none => none.insert(Mog2::new(Mog2Params::default()).map_err(unfit)?),
        };
        let mask = match &mut self.mask {
            Some(mask) => mask,
            none => none.insert(Image::filled(1, 1, 0).map_err(unfit)?),
        };
        model.apply(frame.gray(), &Learning::default(), mask).map_err(unfit)
    }
}

fn false_colors(depth: ImageView<'_, u16>) -> Result<Image<Rgb8>, Refusal> {
    // Every fourth pixel each way says enough of the range.
    let rows = depth.rows().step_by(4);
    let mut known: Vec<u16> = rows.flat_map(|row| row.iter().step_by(4).copied()).filter(|mm| *mm > 0).collect();
    known.sort_unstable();
    let quantile = |q: f64| known.get((q * known.len().saturating_sub(1) as f64) as usize).copied();
    let (near, far) = (quantile(QUANTILES.0).unwrap_or(0), quantile(QUANTILES.1).unwrap_or(0));
    let (near, span) = (f64::from(near), f64::from(far.saturating_sub(near)).max(1.0));
    let mut image = Image::filled(depth.width(), depth.height(), UNKNOWN).map_err(unfit)?;
    for (y, row) in depth.rows().enumerate() {
        for (out, mm) in image.row_mut(y).iter_mut().zip(row).filter(|(_, mm)| **mm > 0) {
            *out = color((f64::from(*mm) - near) / span);
        }
    }
    Ok(image)
}

/// Near is red, then yellow, green, cyan, and far is blue.
fn color(share: f64) -> Rgb8 {
    let hue = 4.0 * share.clamp(0.0, 1.0);
    let rising = |low: f64| (255.0 * (hue - low).clamp(0.0, 1.0)) as u8;
    let falling = |low: f64| 255 - rising(low);
    [falling(1.0), if hue < 3.0 { rising(0.0) } else { falling(3.0) }, rising(2.0)]
}

fn unfit(error: impl std::fmt::Display) -> Refusal {
    Refusal::unfit(format!("this frame cannot be looked at so: {error}"))
}
