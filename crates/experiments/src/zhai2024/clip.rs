//! One clip with depth, followed by one tracker: what the paper counts, and what its occlusion costs.

use crate::ExperimentError;
use pursuit_evaluation::metrics::one_pass::{success_auc, success_rate};
use pursuit_evaluation::metrics::princeton::Claim;
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_tracking::{Recipe, TrackState};
use std::time::Instant;

/// What is true of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Shown {
    /// Where the target is, visible or not; `None` where that is not known, or it is not there.
    pub(crate) bbox: Option<BBox>,
    /// The share of it that can be seen; NaN where nothing is known.
    pub(crate) visible: f64,
}

/// What a tracker said of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Reported {
    pub(crate) bbox: BBox,
    pub(crate) state: TrackState,
}

/// A clip as a tracker followed it, frame by frame, without the first.
#[derive(Debug, Clone, Default)]
pub(crate) struct Followed {
    pub(crate) frames: Vec<(Shown, Reported)>,
    /// Seconds that the updates took.
    pub(crate) seconds: f64,
}

/// From this visible share on a target counts as visible.
const VISIBLE: f64 = 0.5;
/// Wholly in sight, and wholly out of it.
const IN_SIGHT: f64 = 0.8;
const OUT_OF_SIGHT: f64 = 0.2;
/// A target that comes back has to be followed again within so many frames.
pub(crate) const RELOCK_FRAMES: usize = 5;

/// Follows a target through frames, the first of which it is started on.
pub(crate) fn follow(
    recipe: &dyn Recipe,
    frames: impl Iterator<Item = (Frame, Shown)>,
) -> Result<Followed, ExperimentError> {
    let mut frames = frames;
    let mut followed = Followed::default();
    let Some((first, Shown { bbox: Some(bbox), .. })) = frames.next() else { return Ok(followed) };
    let mut tracker = recipe.init(&first, bbox)?;
    for (frame, shown) in frames {
        let start = Instant::now();
        let estimate = tracker.update(&frame)?;
        followed.seconds += start.elapsed().as_secs_f64();
        if shown.visible.is_nan() {
            continue;
        }
        followed.frames.push((shown, Reported { bbox: estimate.bbox, state: estimate.state }));
    }
    Ok(followed)
}

impl Followed {
    /// Frames in which the target is visible, with its place.
    fn visible(&self) -> impl Iterator<Item = (BBox, Reported)> + '_ {
        let visible =
            |(shown, said): &(Shown, Reported)| Some((shown.bbox.filter(|_| shown.visible >= VISIBLE)?, *said));
        self.frames.iter().filter_map(visible)
    }

    /// Overlaps in the frames in which the target is visible; a tracker that says it does not see it has none.
    pub(crate) fn overlaps(&self) -> Vec<f64> {
        let overlap = |(truth, said): (BBox, Reported)| {
            if said.state == TrackState::Tracking { truth.iou(&said.bbox) } else { 0.0 }
        };
        self.visible().map(overlap).collect()
    }

    /// Area under the curve of success.
    pub(crate) fn auc(&self) -> f64 {
        success_auc(&self.overlaps())
    }

    /// The share of visible frames with an overlap above one half.
    pub(crate) fn precision(&self) -> f64 {
        success_rate(&self.overlaps(), 0.5)
    }

    /// Errors of the centre of the box reported, in the frames in which the target is visible: along x, along y, and in all.
    pub(crate) fn center_errors(&self) -> Vec<[f64; 3]> {
        let error = |(truth, said): (BBox, Reported)| {
            let (t, s) = (truth.center(), said.bbox.center());
            [(t.x - s.x).abs(), (t.y - s.y).abs(), t.distance(s)]
        };
        self.visible().map(error).collect()
    }

    /// What the Princeton benchmark wants to know of every frame.
    pub(crate) fn claims(&self) -> Vec<Claim> {
        let claim = |(shown, said): &(Shown, Reported)| {
            let overlap = shown.bbox.map_or(0.0, |b| b.iou(&said.bbox));
            Claim { visible: shown.visible >= VISIBLE, output: said.state == TrackState::Tracking, overlap }
        };
        self.frames.iter().map(claim).collect()
    }

    /// Frames wholly out of sight: how many said so, of how many.
    pub(crate) fn occlusions_told(&self) -> (usize, usize) {
        let hidden = self.frames.iter().filter(|(shown, _)| shown.visible <= OUT_OF_SIGHT);
        let told = hidden.clone().filter(|(_, said)| said.state != TrackState::Tracking);
        (told.count(), hidden.count())
    }

    /// Frames wholly in sight, but for the first ones after an occlusion: how many were called occluded, of how many.
    pub(crate) fn false_alarms(&self) -> (usize, usize) {
        let (mut alarms, mut all, mut since) = (0, 0, usize::MAX);
        for (shown, said) in &self.frames {
            if shown.visible < IN_SIGHT {
                since = 0;
                continue;
            }
            since = since.saturating_add(1);
            if since > RELOCK_FRAMES {
                all += 1;
                alarms += usize::from(said.state != TrackState::Tracking);
            }
        }
        (alarms, all)
    }

    /// After an occlusion, from the frame on in which the target is in sight again: whether it was followed within five
    /// frames. `None` where nothing was hidden, or nothing came back.
    pub(crate) fn relocked(&self) -> Option<bool> {
        let hidden = self.frames.iter().rposition(|(shown, _)| shown.visible <= OUT_OF_SIGHT)?;
        let back = hidden + self.frames[hidden..].iter().position(|(shown, _)| shown.visible >= IN_SIGHT)?;
        let window = self.frames.iter().skip(back).take(RELOCK_FRAMES + 1);
        Some(window.clone().any(|(shown, said)| {
            said.state == TrackState::Tracking && shown.bbox.is_some_and(|b| b.iou(&said.bbox) > 0.5)
        }))
    }

    /// Whether the target is not followed at the end, though it is in sight.
    pub(crate) fn missed(&self) -> bool {
        let last = self.frames.last();
        last.is_some_and(|(shown, said)| {
            let on_it = shown.bbox.is_some_and(|b| b.iou(&said.bbox) > 0.0);
            shown.visible >= IN_SIGHT && !(on_it && said.state == TrackState::Tracking)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64) -> BBox {
        BBox::from_ltwh(x, 0.0, 10.0, 10.0)
    }

    /// Frames of (visible share, displacement of what is said, whether it is said to be seen).
    fn clip(frames: &[(f64, f64, bool)]) -> Followed {
        let frame = |&(visible, off, seen): &(f64, f64, bool)| {
            let state = if seen { TrackState::Tracking } else { TrackState::Occluded };
            (Shown { bbox: Some(at(50.0)), visible }, Reported { bbox: at(50.0 + off), state })
        };
        Followed { frames: frames.iter().map(frame).collect(), seconds: 0.5 }
    }

    #[test]
    fn frames_count_as_what_they_are() {
        let clip = clip(&[(1.0, 0.0, true), (0.6, 5.0, true), (0.6, 0.0, false), (0.1, 0.0, false), (0.0, 0.0, true)]);
        let overlaps = clip.overlaps();
        assert_eq!(overlaps.len(), 3);
        assert!((overlaps[1] - 1.0 / 3.0).abs() < 1e-12 && overlaps[2] == 0.0);
        assert!((clip.precision() - 1.0 / 3.0).abs() < 1e-12);
        assert_eq!(clip.center_errors()[1], [5.0, 0.0, 5.0]);
        assert_eq!((clip.occlusions_told(), clip.false_alarms()), ((1, 2), (0, 1)));
        let types = pursuit_evaluation::metrics::princeton::error_types(&clip.claims(), 0.5);
        assert_eq!((types.success, types.wrong_box), (0.4, 0.2));
        assert_eq!((types.false_box, types.missing_box), (0.2, 0.2));
    }

    #[test]
    fn a_target_that_comes_back_has_five_frames() {
        let mut frames = vec![(1.0, 0.0, true), (0.0, 0.0, false), (0.5, 0.0, false)];
        frames.extend([(0.9, 0.0, false); 5]);
        assert_eq!(clip(&frames).relocked(), Some(false));
        assert!(clip(&frames).missed());
        frames.push((1.0, 0.0, true));
        assert_eq!(clip(&frames).relocked(), Some(true));
        assert!(!clip(&frames).missed());
        frames[8] = (1.0, 6.0, true);
        assert_eq!(clip(&frames).relocked(), Some(false), "somewhere else");
        assert!(!clip(&frames).missed(), "but on it");
        assert_eq!(clip(&[(1.0, 0.0, true)]).relocked(), None);
        // The frames that it has are no false alarms.
        assert_eq!(clip(&frames).false_alarms(), (0, 2));
    }
}
