//! From what was said and what is true to figures, for one pass.

use crate::metrics::calibration::Forecast;
use crate::metrics::long_term::Judged;
use crate::metrics::one_pass;
use crate::metrics::supervised::Supervised;
use crate::{Output, RunRecord, Sequence, Trajectory, Truth};
use pursuit_geometry::BBox;
use pursuit_tracking::TrackState;

/// One pass, frame by frame.
///
/// Frames before the first start and after the end of the footage are left out. A frame reported `lost`, or about which
/// nothing is said, has no box: overlap 0 and an infinite centre error.
#[derive(Debug, Clone, Default)]
pub(crate) struct Scored {
    /// Overlap in every visible frame, the start included (OTB).
    pub overlaps: Vec<f64>,
    /// Centre error in pixels in the same frames.
    pub center_errors: Vec<f64>,
    /// The same in units of the target's size.
    pub normalized_errors: Vec<f64>,
    /// Fraction of the same frames without a box.
    pub lost: f64,
    /// Overlaps without the start (GOT-10k).
    pub overlaps_after_start: Vec<f64>,
    /// Every frame after the start whose truth is known.
    pub judged: Vec<Judged>,
    /// The scores of these frames, and whether they came true.
    pub forecasts: Vec<Forecast>,
}

impl Scored {
    pub fn new(sequence: &Sequence, trajectory: &Trajectory, record: &RunRecord) -> Self {
        let mut scored = Self::default();
        let start = record.starts.first().copied().or_else(|| sequence.first_visible().map(|(i, _)| i)).unwrap_or(0);
        let mut without_box = 0usize;
        for (i, truth) in sequence.truth().iter().enumerate().take(record.frames).skip(start) {
            let output = trajectory.get(i);
            let bbox = believed(output);
            let overlap = overlap(truth, bbox);
            if let Some(t) = truth.bbox() {
                let error = |measure: fn(&BBox, &BBox) -> f64| bbox.map_or(f64::INFINITY, |b| measure(&t, &b));
                scored.overlaps.push(overlap);
                scored.center_errors.push(error(|t, b| t.center().distance(b.center())));
                scored.normalized_errors.push(error(one_pass::normalized_center_error));
                without_box += usize::from(bbox.is_none());
            }
            if i > start {
                scored.judge(truth, output, overlap);
            }
        }
        scored.lost = without_box as f64 / scored.overlaps.len().max(1) as f64;
        scored
    }

    fn judge(&mut self, truth: &Truth, output: Option<&Output>, overlap: f64) {
        let visible = match truth {
            Truth::Visible(_) => true,
            Truth::Absent => false,
            Truth::Unknown => return,
        };
        if visible {
            self.overlaps_after_start.push(overlap);
        }
        let alive = output.is_some_and(|o| o.state == TrackState::Tracking);
        let score = output.map_or(0.0, |o| o.score);
        self.judged.push(Judged { visible, alive, overlap, score });
        // What the box itself is worth, whatever the state: the score speaks of the box.
        let hit = truth.bbox().zip(output).is_some_and(|(t, o)| t.iou(&o.bbox) >= 0.5);
        self.forecasts.extend(output.map(|o| Forecast { score: o.score, hit }));
    }
}

/// The box that a frame is scored by: none where nothing is said, or `lost`.
pub fn believed(output: Option<&Output>) -> Option<BBox> {
    output.filter(|o| o.state != TrackState::Lost).map(|o| o.bbox)
}

/// Overlap with the truth; 0 where either is missing.
pub fn overlap(truth: &Truth, bbox: Option<BBox>) -> f64 {
    truth.bbox().zip(bbox).map_or(0.0, |(t, b)| t.iou(&b))
}

/// What happened in every frame of a supervised run; frames of unknown or absent truth are passed over.
pub(crate) fn supervised(sequence: &Sequence, trajectory: &Trajectory, record: &RunRecord) -> Vec<Supervised> {
    let frame = |(i, truth): (usize, &Truth)| {
        if record.starts.contains(&i) {
            return Supervised::Init;
        }
        if record.failures.contains(&i) {
            return Supervised::Failure;
        }
        match trajectory.get(i) {
            Some(output) if truth.bbox().is_some() => Supervised::Overlap(overlap(truth, believed(Some(output)))),
            _ => Supervised::Skipped,
        }
    };
    sequence.truth().iter().enumerate().take(record.frames).map(frame).collect()
}
