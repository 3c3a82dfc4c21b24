//! Figures of one pass, from its trajectory and the truth.

use crate::metrics::accuracy::{believed, is_hit, overlap};
use crate::metrics::calibration::ScoreForecast;
use crate::metrics::long_term::ScoredFrame;
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
    pub judged: Vec<ScoredFrame>,
    /// The scores of these frames, and whether they came true.
    pub forecasts: Vec<ScoreForecast>,
}

impl Scored {
    pub fn new(sequence: &Sequence, trajectory: &Trajectory, record: &RunRecord) -> Self {
        let mut scored = Self::default();
        let start = record.starts.first().copied().or_else(|| sequence.first_visible().map(|(i, _)| i)).unwrap_or(0);
        let mut without_box = 0usize;
        for (i, truth) in sequence.truth().iter().enumerate().take(record.frames).skip(start) {
            let output = trajectory.get(i);
            let bbox = believed(output);
            let overlap = overlap(truth, output);
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
        if !trajectory.has_probabilities() {
            scored.forecasts.clear();
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
        self.judged.push(ScoredFrame { visible, alive, overlap, score });
        // Whatever state is reported: `score` is the probability that the box is right.
        self.forecasts.extend(output.map(|o| ScoreForecast { score: o.score, hit: is_hit(truth, o) }));
    }
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
            Some(output) if truth.bbox().is_some() => Supervised::Overlap(overlap(truth, Some(output))),
            _ => Supervised::Skipped,
        }
    };
    sequence.truth().iter().enumerate().take(record.frames).map(frame).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Protocol;
    use crate::metrics::accuracy::AccuracyMeter;
    use pursuit_tracking::Estimate;

    /// Ten pixels wide and high, `left` pixels from where the target is.
    fn square(left: f64) -> BBox {
        BBox::from_ltwh(left, 0.0, 10.0, 10.0)
    }

    fn here() -> Truth {
        Truth::Visible(square(0.0))
    }

    fn record(frames: usize, starts: &[usize], failures: &[usize]) -> RunRecord {
        RunRecord {
            tracker: "none".to_owned(),
            parameters: serde_json::Value::Null,
            build: String::new(),
            protocol: Protocol::Ope,
            footage_bytes: None,
            start_box: None,
            frames,
            starts: starts.to_vec(),
            failures: failures.to_vec(),
            init_ms: 0.0,
            update: None,
            masks: Vec::new(),
            error: None,
        }
    }

    fn said(of: &[(usize, f64, TrackState, f64)], frames: usize) -> Trajectory {
        let mut trajectory = Trajectory::silent(frames);
        for &(frame, left, state, score) in of {
            trajectory.set(frame, Output { bbox: square(left), state, score });
        }
        trajectory
    }

    fn sequence(truth: Vec<Truth>) -> Sequence {
        Sequence::from_frames("test", Vec::new(), truth)
    }

    /// Unknown, visible (the start), visible ×3, absent ×2, unknown, visible, and two frames beyond the footage.
    fn case() -> (Sequence, Trajectory, RunRecord) {
        use TrackState::{Lost, Occluded, Tracking, Unsure};
        let truth = [
            Truth::Unknown,
            here(),
            here(),
            here(),
            here(),
            Truth::Absent,
            Truth::Absent,
            Truth::Unknown,
            here(),
            here(),
            here(),
        ];
        let outputs = [
            (1, 0.0, Tracking, 1.0),
            (2, 2.0, Tracking, 0.9),
            (3, 0.0, Lost, 0.2),
            (4, 5.0, Unsure, 0.4),
            (5, 0.0, Tracking, 0.6),
            (6, 0.0, Occluded, 0.3),
            (7, 0.0, Tracking, 0.8),
            (9, 0.0, Tracking, 0.7),
        ];
        (sequence(truth.to_vec()), said(&outputs, 11), record(9, &[1], &[]))
    }

    #[test]
    fn a_pass_is_scored_frame_by_frame() {
        let (sequence, trajectory, record) = case();
        let scored = Scored::new(&sequence, &trajectory, &record);
        let third = 5.0 / 15.0;
        assert_eq!(scored.overlaps, [1.0, 8.0 / 12.0, 0.0, third, 0.0], "lost and silent frames have no box");
        assert_eq!(scored.overlaps_after_start, [8.0 / 12.0, 0.0, third, 0.0]);
        assert_eq!(scored.center_errors, [0.0, 2.0, f64::INFINITY, 5.0, f64::INFINITY]);
        assert_eq!(scored.normalized_errors, [0.0, 0.2, f64::INFINITY, 0.5, f64::INFINITY]);
        assert_eq!(scored.lost, 2.0 / 5.0);
        let judged = |visible, alive, overlap, score| ScoredFrame { visible, alive, overlap, score };
        let expected = [
            judged(true, true, 8.0 / 12.0, 0.9),
            judged(true, false, 0.0, 0.2),
            judged(true, false, third, 0.4),
            judged(false, true, 0.0, 0.6),
            judged(false, false, 0.0, 0.3),
            judged(true, false, 0.0, 0.0),
        ];
        assert_eq!(scored.judged, expected);
        let forecast = |score, hit| ScoreForecast { score, hit };
        let expected = [
            forecast(0.9, true),
            forecast(0.2, true), // the box was right, whatever was said of it
            forecast(0.4, false),
            forecast(0.6, false),
            forecast(0.3, false),
        ];
        assert_eq!(scored.forecasts, expected);
    }

    #[test]
    fn unstarted_passes_are_scored_from_first_truth() {
        let (sequence, _, _) = case();
        let scored = Scored::new(&sequence, &Trajectory::silent(11), &record(9, &[], &[]));
        assert_eq!((scored.overlaps.len(), scored.judged.len(), scored.lost), (5, 6, 1.0));
        assert!(scored.overlaps.iter().all(|o| *o == 0.0) && scored.forecasts.is_empty());
        let nothing = Scored::new(&sequence_of_unknowns(), &Trajectory::silent(3), &record(3, &[], &[]));
        assert_eq!((nothing.overlaps.len(), nothing.lost), (0, 0.0));
    }

    fn sequence_of_unknowns() -> Sequence {
        sequence(vec![Truth::Unknown; 3])
    }

    #[test]
    fn the_running_meter_gives_the_same_figures() {
        let (sequence, trajectory, record) = case();
        let scored = Scored::new(&sequence, &trajectory, &record);
        let mut meter = AccuracyMeter::default();
        for (i, truth) in sequence.truth().iter().enumerate().take(record.frames).skip(record.starts[0] + 1) {
            let estimate = trajectory.get(i).map(|o| Estimate {
                state: o.state,
                measurement: None,
                ..Estimate::started(0.0, o.bbox, o.score)
            });
            meter.add(*truth, estimate.as_ref());
        }
        let running = meter.accuracy().unwrap();
        assert_eq!(running.mean_iou, one_pass::average_overlap(&scored.overlaps_after_start));
        assert_eq!(Some(running.false_alive), crate::metrics::long_term::false_alive(&scored.judged));
        assert_eq!(running.visible_frames as usize, scored.overlaps_after_start.len());
    }

    #[test]
    fn a_supervised_run_names_what_happened() {
        use Supervised::{Failure, Init, Overlap, Skipped};
        let truth = vec![here(), here(), here(), here(), Truth::Absent, here(), here(), here()];
        let outputs = [
            (0, 0.0, TrackState::Tracking, 1.0),
            (1, 5.0, TrackState::Tracking, 1.0),
            (2, 50.0, TrackState::Tracking, 1.0),
            (4, 0.0, TrackState::Tracking, 1.0),
            (5, 0.0, TrackState::Tracking, 1.0),
            (6, 0.0, TrackState::Lost, 1.0),
            (7, 0.0, TrackState::Tracking, 1.0),
        ];
        let found = supervised(&sequence(truth), &said(&outputs, 8), &record(7, &[0, 5], &[2]));
        let expected = [Init, Overlap(5.0 / 15.0), Failure, Skipped, Skipped, Init, Overlap(0.0)];
        assert_eq!(found, expected, "frame 7 lies beyond the footage");
    }
}
