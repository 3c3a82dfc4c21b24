//! Masks by the background of a camera that stands still: what a detector that knows it says of the frame, else what differs from a
//! selective running average of its own, which learns everything but the target.

use super::pieces::Pieces;
use super::{MaskParams, about};
use crate::backdrop::{Backdrop, BackdropParams};
use pursuit_geometry::{BBox, Mask};
use pursuit_imaging::Frame;
use pursuit_vision::PixelWindow;
use pursuit_vision::background::{FOREGROUND, learning_rate};
use serde::{Deserialize, Serialize};

/// Which pixels stand out of the background.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(remote = "MotionSegmenter")]
pub struct MotionSegmenter {
    params: MaskParams,
    /// What it knows of the background where nobody shows it what stands out ([`Frame::foreground`]).
    backdrop: Option<Backdrop>,
    time_s: f64,
    #[serde(skip)]
    scratch: (Vec<bool>, Pieces),
}

pursuit_estimation::checked!(MotionSegmenter);

impl MotionSegmenter {
    /// Begins to learn the background about the target at `bbox`.
    pub(super) fn new(params: &MaskParams, frame: &Frame, bbox: &BBox) -> Self {
        let mut new =
            Self { params: params.clone(), backdrop: None, time_s: frame.time_s(), scratch: Default::default() };
        new.learn(frame, bbox);
        new
    }

    /// Begins anew with the target at `bbox`.
    pub(super) fn restart(&mut self, frame: &Frame, bbox: &BBox) {
        *self = Self::new(&self.params, frame, bbox);
    }

    fn restored(self) -> Result<Self, &'static str> {
        use pursuit_parameters::Parameters;
        if self.params.check_all().is_ok() { Ok(self) } else { Err("its mask is out of range") }
    }

    fn learn(&mut self, frame: &Frame, bbox: &BBox) {
        let dt_s = frame.time_s() - self.time_s;
        self.time_s = frame.time_s();
        if frame.foreground().is_some() {
            self.backdrop = None;
            return;
        }
        let params = BackdropParams { margin: self.params.slack, ..BackdropParams::default() };
        let rate = learning_rate(dt_s, self.params.motion.history_s);
        match &mut self.backdrop {
            Some(backdrop) if backdrop.fits(frame) => {
                backdrop.place(&params, frame, &about(bbox, self.params.slack));
                backdrop.learn(&params, frame, bbox, rate);
            }
            other => other.insert(Backdrop::new(frame)).learn(&params, frame, bbox, 1.0),
        }
    }

    /// The target's pixels at `bbox`; learns the background about them.
    pub(super) fn look(&mut self, frame: &Frame, bbox: &BBox) -> Option<Mask> {
        let seen = self.see(frame, bbox);
        self.learn(frame, bbox);
        seen
    }

    fn see(&mut self, frame: &Frame, bbox: &BBox) -> Option<Mask> {
        let around = about(bbox, self.params.slack);
        let window = PixelWindow::of(&around, frame.size())?;
        let (out, pieces) = &mut self.scratch;
        out.clear();
        let mut known = 0_usize;
        let columns = window.x..window.x + window.width;
        let rows = window.y..window.y + window.height;
        if let Some(backdrop) = self.backdrop.as_mut().filter(|b| b.fits(frame)) {
            backdrop.place(&BackdropParams::default(), frame, &around);
        }
        match (frame.foreground(), &self.backdrop) {
            (Some(told), _) => {
                rows.for_each(|y| out.extend(told.row(y)[columns.clone()].iter().map(|v| *v == FOREGROUND)));
                known = out.len();
            }
            (None, Some(backdrop)) if backdrop.fits(frame) => {
                let gain = backdrop.gain(&BackdropParams::default(), frame, &around);
                let gain = (gain * 256.0).round().clamp(1.0, 4096.0) as i32;
                let threshold = i32::try_from(self.params.motion.threshold).unwrap_or(i32::MAX >> 8);
                for y in rows {
                    let row = backdrop.row(frame, y);
                    for x in columns.clone() {
                        let stands_out = backdrop.stands_out(row, x, y, gain, threshold);
                        known += usize::from(stands_out.is_some());
                        out.push(stands_out.unwrap_or(false));
                    }
                }
            }
            (None, _) => return None,
        }
        if (known as f64) < self.params.motion.least_known * out.len() as f64 {
            return None;
        }
        pieces.keep_large(out, window.width, self.params.least_piece);
        let mut mask = Mask::default();
        for (y, row) in out.chunks(window.width).enumerate() {
            mask.extend_row(window.y + y, window.x, row.iter().copied());
        }
        let inside = bbox.clipped_to(frame.size())?.area().max(1.0);
        (mask.area() as f64 >= self.params.least_fill * inside).then_some(mask)
    }
}
