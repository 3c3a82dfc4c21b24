//! Detections from outside.

use super::super::target::{Sighting, View};
use super::super::{TargetId, Track};
use super::Associating;
use crate::belief::Stamp;
use crate::{Detection, Result, TrackingError};
use pursuit_geometry::Size;
use pursuit_imaging::Frame;
use serde::{Deserialize, Serialize};

/// The picture where nobody said how large it is: it ends at the left and at the top alone.
const ENDLESS: Size = Size::new(1 << 30, 1 << 30);

/// Farther from the origin than this no detection may reach, in pixels: its area must be a number still.
const FARTHEST_PX: f64 = 1e9;

/// What is known of the frames that came from outside.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Fed {
    /// How many there were.
    frames: u64,
    /// The time of the last one, in seconds.
    time_s: Option<f64>,
    /// Width and height.
    size: Option<(usize, usize)>,
}

impl Fed {
    /// Whether it can be known: what is restored is checked.
    pub fn is_sound(&self) -> bool {
        self.time_s.is_none_or(f64::is_finite)
    }
}

impl Associating {
    /// Takes the detections of the next frame, which was taken at `time_s` (seconds, not before the frame before), and says what is
    /// known of every target now, in ascending order of ids; each says which of `detections` it was given. `size` is that of the
    /// picture in pixels, the same for all frames; without it no target is known to have left the picture to the right or downward.
    ///
    /// Detections without an area are passed over, as are those below `association.least_confidence`.
    ///
    /// # Errors
    /// [`TrackingError::Time`] where time runs backward or is none; [`TrackingError::FrameSize`] where the size differs from that
    /// of the frame before; [`TrackingError::Detection`] for a box that is not finite or reaches beyond 10⁹ pixels, or a confidence
    /// outside of `[0, 1]`. Everything is then as before, and the next frame may come.
    pub fn update(&mut self, time_s: f64, size: Option<Size>, detections: &[Detection]) -> Result<&[Track]> {
        let index = self.fed.frames;
        let before_s = self.fed.time_s.unwrap_or(time_s);
        if !time_s.is_finite() || time_s < before_s {
            return Err(TrackingError::Time { index, time_s, before_s });
        }
        let actual = size.unwrap_or(ENDLESS);
        let (width, height) = self.fed.size.unwrap_or((actual.width, actual.height));
        let expected = Size::new(width, height);
        if actual != expected {
            return Err(TrackingError::FrameSize { index, expected, actual });
        }
        check(index, detections)?;
        self.go_on(View { stamp: Stamp { index, time_s, size: actual }, frame: None }, detections)
    }

    /// The same with the frame's pixels, for the camera's motion and appearance.
    ///
    /// # Errors
    /// As [`update`](Self::update), and where the frame lacks what appearance needs.
    pub fn update_in(&mut self, frame: &Frame, detections: &[Detection]) -> Result<&[Track]> {
        let (index, time_s) = (frame.index(), frame.time_s());
        let before_s = self.fed.time_s.unwrap_or(time_s);
        if !time_s.is_finite() || time_s < before_s {
            return Err(TrackingError::Time { index, time_s, before_s });
        }
        check(index, detections)?;
        self.go_on(frame.into(), detections)
    }

    /// Where the targets confirmed in the last frame were seen before.
    pub(in crate::many) fn back_dated(&self) -> impl Iterator<Item = (TargetId, Sighting)> + '_ {
        self.back_dated.iter().copied()
    }

    /// What targets took in frames before, and not what was said then: how many frames before the last one, and which of the detections
    /// that were sure enough (`None`: none).
    pub(in crate::many) fn revised(&self) -> impl Iterator<Item = (TargetId, u64, Option<usize>)> + '_ {
        let named = self.targets.iter().filter_map(|t| Some((t.id()?, t)));
        named.flat_map(|(id, t)| t.revised().map(move |(ago, taken)| (id, ago, taken)))
    }

    fn go_on(&mut self, view: View<'_>, detections: &[Detection]) -> Result<&[Track]> {
        self.predict(view)?;
        let Stamp { time_s, size, .. } = view.stamp;
        self.fed = Fed { frames: self.fed.frames + 1, time_s: Some(time_s), size: Some((size.width, size.height)) };
        let mut said = std::mem::take(&mut self.said);
        let taken = self.take(view, detections, &mut said);
        self.said = said;
        taken.map(|()| self.said.as_slice())
    }
}

fn check(index: u64, detections: &[Detection]) -> Result<()> {
    for (at, Detection { bbox, confidence, .. }) in detections.iter().enumerate() {
        let farthest =
            [bbox.left(), bbox.top(), bbox.right(), bbox.bottom()].into_iter().map(f64::abs).fold(0.0, f64::max);
        let problem = if !bbox.is_finite() {
            "has a coordinate that is not a finite number"
        } else if farthest > FARTHEST_PX {
            "reaches farther than 10⁹ pixels"
        } else if !(0.0..=1.0).contains(confidence) {
            "has a confidence outside of 0 to 1"
        } else {
            continue;
        };
        return Err(TrackingError::Detection { at, index, bbox: *bbox, problem });
    }
    Ok(())
}
