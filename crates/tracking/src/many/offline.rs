//! A whole clip at once: births are back-dated and gaps filled.

use super::associating::usable;
use super::{Associating, ManyParams, TargetId};
use crate::{Class, Detection, Result, TrackState};
use pursuit_geometry::{BBox, Point, Size};
use std::collections::BTreeMap;

pursuit_parameters::parameters! {
    /// What is done where the whole clip is known.
    pub struct OfflineParams {
        /// Gaps of at most so long are filled, in a straight line from where the target was seen last to where it was seen next.
        pub gap_s: f64 = 1.0, in 0.0.., unit "s", source "zhang2022, section 4.2: 20 frames";
        /// A target that was detected in fewer frames was none.
        pub shortest: usize = 3, in 1..=1_000_000, unit "frames", source "ours";
        /// Error of the first kind of the test by which candidates are confirmed, in place of `birth.ratio.false_start`: the frames
        /// before are not lost here, and so it may be strict.
        pub false_start: f64 = 0.002, in above(0.0).below(0.5), source "ours";
    }
}

/// The detections of a frame.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Looked {
    /// When it was taken, in seconds.
    pub time_s: f64,
    /// What was seen in it.
    pub detections: Vec<Detection>,
}

/// Where a target was in a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Placed {
    /// The target.
    pub id: TargetId,
    /// Its box.
    pub bbox: BBox,
    /// The score, in `[0, 1]`: of a measured box what was said of it, of another that of the gap's surer end.
    pub score: f64,
    /// What it is, as far as that was known at the end.
    pub class: Option<Class>,
    /// Which of the frame's detections it is; `None` where the box was not measured.
    pub detection: Option<usize>,
}

/// One sighting of a target, while they are gathered.
#[derive(Debug, Clone, Copy)]
struct Seen {
    bbox: BBox,
    score: f64,
    detection: Option<usize>,
}

/// Follows what was detected in a whole clip: as [`Associating::update`] frame by frame, then with the frames before a target's
/// confirmation and the gaps in which it was not seen; what `hypotheses` decided later is put right in the frames before. Answers for each frame, targets in ascending order of ids.
///
/// # Errors
/// As [`Associating::fed`] and [`Associating::update`], and for a parameter out of range.
pub fn offline(
    params: ManyParams,
    offline: &OfflineParams,
    size: Option<Size>,
    frames: &[Looked],
) -> Result<Vec<Vec<Placed>>> {
    use pursuit_parameters::Parameters;
    offline.validate("offline")?;
    let mut params = params;
    params.birth.ratio.false_start = offline.false_start;
    let least = params.association.least_confidence;
    let mut many = Associating::fed(params)?;
    let mut seen: BTreeMap<TargetId, BTreeMap<usize, Seen>> = BTreeMap::new();
    let mut classes: BTreeMap<TargetId, Class> = BTreeMap::new();
    for (k, frame) in frames.iter().enumerate() {
        for track in many.update(frame.time_s, size, &frame.detections)? {
            classes.extend(track.class.clone().map(|class| (track.id, class)));
            let Some(estimate) = track.estimate.as_ref().filter(|e| e.state == TrackState::Tracking) else { continue };
            let now = Seen { bbox: estimate.bbox, score: estimate.score, detection: track.detection };
            seen.entry(track.id).or_default().insert(k, now);
        }
        for (id, ago, taken) in many.revised() {
            let Some(before) = usize::try_from(ago).ok().and_then(|ago| k.checked_sub(ago)) else { continue };
            let path = seen.entry(id).or_default();
            match taken.and_then(|taken| usable(least, &frames[before].detections).nth(taken)) {
                Some((place, Detection { bbox, confidence, .. })) => {
                    path.insert(before, Seen { bbox: *bbox, score: *confidence, detection: Some(place) });
                }
                None => {
                    path.remove(&before);
                }
            }
        }
        for (id, before) in many.back_dated() {
            let Ok(k) = usize::try_from(before.index) else { continue };
            let then = Seen { bbox: before.bbox, score: before.confidence, detection: Some(before.place) };
            seen.entry(id).or_default().entry(k).or_insert(then);
        }
    }
    let mut placed: Vec<Vec<Placed>> = frames.iter().map(|_| Vec::new()).collect();
    for (id, path) in seen.iter().filter(|(_, path)| path.len() >= offline.shortest) {
        let class = classes.get(id);
        let mut put = |k: usize, s: Seen| {
            let Seen { bbox, score, detection } = s;
            if let Some(frame) = placed.get_mut(k) {
                frame.push(Placed { id: *id, bbox, score, class: class.cloned(), detection });
            }
        };
        let mut last: Option<(usize, Seen)> = None;
        for (k, now) in path {
            if let Some((from, before)) = last {
                fill(frames, (from, &before), (*k, now), offline.gap_s, &mut put);
            }
            put(*k, *now);
            last = Some((*k, *now));
        }
    }
    Ok(placed)
}

/// Puts boxes between two sightings, in a straight line over the time.
fn fill(frames: &[Looked], from: (usize, &Seen), to: (usize, &Seen), gap_s: f64, put: &mut impl FnMut(usize, Seen)) {
    let time = |k: usize| frames.get(k).map_or(0.0, |f| f.time_s);
    let gap = time(to.0) - time(from.0);
    if gap > gap_s || gap <= 0.0 {
        return;
    }
    let (a, b) = (&from.1.bbox, &to.1.bbox);
    for k in from.0 + 1..to.0 {
        let share = (time(k) - time(from.0)) / gap;
        let between = |a: f64, b: f64| a + share * (b - a);
        let center = Point::new(between(a.center().x, b.center().x), between(a.center().y, b.center().y));
        let bbox = BBox::from_center_size(center, between(a.width(), b.width()), between(a.height(), b.height()));
        put(k, Seen { bbox, score: from.1.score.max(to.1.score), detection: None });
    }
}
