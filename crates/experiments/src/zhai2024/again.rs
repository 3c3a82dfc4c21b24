//! Re-detection, equation (30): how often a filter frozen at the occlusion takes for its target the target that is back, the
//! background, and what hides the target.

use super::clip::Shown;
use super::clips::scene_frames;
use super::params::{AGAIN_OFF, AGAIN_PLACES, LEARNED_FRAMES};
use crate::ExperimentError;
use crate::random::Random;
use pursuit_geometry::{BBox, Point};
use pursuit_imaging::Frame;
use pursuit_trackers::depth_occlusion::{DepthFinding, DepthLocalizer, DepthOcclusionParams};
use pursuit_tracking::{Localizer, LocalizerRecipe, Look, Outcome, Search, TrackState};

/// How many windows were looked at, and in how many of them the target was said to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Count {
    pub(super) all: usize,
    pub(super) accepted: usize,
}

impl Count {
    fn add(&mut self, accepted: bool) {
        self.all += 1;
        self.accepted += usize::from(accepted);
    }

    /// The sum of both.
    pub(super) const fn and(self, other: Self) -> Self {
        Self { all: self.all + other.all, accepted: self.accepted + other.accepted }
    }

    /// The share accepted; NaN of none.
    pub(super) fn rate(self) -> f64 {
        self.accepted as f64 / self.all as f64
    }
}

/// Windows on the target that is back, on the background far from it, and on what hides it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Again {
    pub(super) target: Count,
    pub(super) background: Count,
    pub(super) occluder: Count,
}

impl Again {
    /// The sum of both.
    pub(super) const fn and(self, other: Self) -> Self {
        Self {
            target: self.target.and(other.target),
            background: self.background.and(other.background),
            occluder: self.occluder.and(other.occluder),
        }
    }
}

/// A target in sight, wholly.
const WHOLE: f64 = 0.97;
/// A target out of sight.
const GONE: f64 = 0.02;

/// The windows of one clip. The filter is shown the target where it truly is until it is hidden; from then on it learns
/// nothing.
pub(super) fn windows(params: &DepthOcclusionParams, query: &str, seed: u64) -> Result<Again, ExperimentError> {
    let mut frames = scene_frames(query)?;
    let mut again = Again::default();
    let Some((first, Shown { bbox: Some(bbox), .. })) = frames.next() else { return Ok(again) };
    let mut localizer = params.localizer(&first, bbox)?;
    let mut random = Random::new(30, seed);
    let (mut learned, mut hidden) = (0, false);
    for (frame, shown) in frames {
        let Some(there) = shown.bbox else { continue };
        if !hidden && shown.visible >= WHOLE {
            learn(&mut localizer, &frame, there)?;
            learned += 1;
        } else if shown.visible <= GONE && learned >= LEARNED_FRAMES {
            if !hidden {
                lose(&mut localizer, &frame, there)?;
            }
            hidden = true;
            again.occluder.add(accepts(&mut localizer, &frame, &there)?.is_some());
        } else if hidden && shown.visible >= WHOLE {
            let off = |random: &mut Random| random.uniform(-AGAIN_OFF, AGAIN_OFF);
            let place = there.translated(off(&mut random) * there.width(), off(&mut random) * there.height());
            let found = accepts(&mut localizer, &frame, &place)?;
            again.target.add(found.is_some_and(|b| b.iou(&there) > 0.5));
            for _ in 0..AGAIN_PLACES {
                let Some(place) = elsewhere(&frame, &there, &mut random) else { continue };
                again.background.add(accepts(&mut localizer, &frame, &place)?.is_some());
            }
        }
    }
    Ok(again)
}

/// A window that does not show the target: as wide as two and a half targets, it is three of them away.
fn elsewhere(frame: &Frame, target: &BBox, random: &mut Random) -> Option<BBox> {
    let size = frame.size();
    let (width, height) = (size.width as f64, size.height as f64);
    let at = target.center();
    (0..50).find_map(|_| {
        let center = Point::new(random.uniform(0.0, width), random.uniform(0.0, height));
        let place = target.centered_at(center);
        let apart = (center.x - at.x).abs() > 3.0 * target.width() || (center.y - at.y).abs() > 3.0 * target.height();
        let inside = place.left() >= 0.0 && place.top() >= 0.0 && place.right() <= width && place.bottom() <= height;
        (apart && inside).then_some(place)
    })
}

fn search(expected: BBox) -> Search {
    Search { expected, region: expected.scaled(2.5), gate: None, look: Look::Near, keep_inside: false }
}

fn learn(localizer: &mut DepthLocalizer, frame: &Frame, there: BBox) -> Result<(), ExperimentError> {
    let found = localizer.locate(frame, &search(there))?;
    if let Some((_, finding)) = &found {
        localizer.adapt(frame, there, finding)?;
    }
    tell(localizer, frame, there, TrackState::Tracking, found.as_ref().map(|(m, finding)| (m.bbox, finding)))
}

fn lose(localizer: &mut DepthLocalizer, frame: &Frame, there: BBox) -> Result<(), ExperimentError> {
    tell(localizer, frame, there, TrackState::Occluded, None)
}

fn tell(
    localizer: &mut DepthLocalizer,
    frame: &Frame,
    bbox: BBox,
    state: TrackState,
    found: Option<(BBox, &DepthFinding)>,
) -> Result<(), ExperimentError> {
    let outcome = Outcome { state, bbox, found, followed: None, dt_s: 1.0 / 30.0 };
    Ok(localizer.observe(frame, &outcome)?)
}

/// The box found in a window, where it is taken for the target.
fn accepts(localizer: &mut DepthLocalizer, frame: &Frame, place: &BBox) -> Result<Option<BBox>, ExperimentError> {
    let found = localizer.locate(frame, &search(*place))?;
    Ok(found.filter(|(m, _)| m.confidence >= 0.5).map(|(m, _)| m.bbox))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_target_is_recognised() {
        let query = |seed: u64| format!("scene:rgbd-occlusion?seed={seed}&hidden=8&duration=2.5");
        for params in [DepthOcclusionParams::default(), DepthOcclusionParams::zhai2024()] {
            let all = (10_000..10_002).map(|seed| windows(&params, &query(seed), seed).unwrap());
            let again = all.reduce(Again::and).unwrap();
            assert!(again.target.all >= 20 && again.background.all >= 20 && again.occluder.all >= 8, "{again:?}");
            // Two dozen windows; the bar of .97 is for hundreds, in the experiment itself.
            assert!(again.target.rate() >= 0.9, "{again:?}");
            assert!(again.background.rate() <= 0.01 && again.occluder.rate() <= 0.01, "{again:?}");
        }
    }

    #[test]
    fn counts_add_up() {
        let mut count = Count::default();
        [true, false, true, true].into_iter().for_each(|v| count.add(v));
        assert_eq!((count.rate(), count.and(count)), (0.75, Count { all: 8, accepted: 6 }));
        assert!(Count::default().rate().is_nan());
    }
}
