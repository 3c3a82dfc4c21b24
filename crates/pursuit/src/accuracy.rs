//! How well a run did, where the input came with the truth; by the metrics of `pursuit eval`.

use crate::Record;
use pursuit_evaluation::metrics::long_term::{Judged, false_alive};
use pursuit_evaluation::metrics::mean;
use pursuit_evaluation::{Output, believed, overlap};
use pursuit_geometry::{BBox, Point};
use pursuit_media::Truth;
use pursuit_tracking::{Estimate, TrackState};
use serde::Serialize;

/// Compares records with the truth, frame by frame.
#[derive(Debug, Clone, Default)]
pub struct AccuracyMeter {
    judged: Vec<Judged>,
    predicted_overlaps: Vec<f64>,
    /// Squared distances of centres, square pixels.
    estimate: Vec<f64>,
    measured: Vec<f64>,
    predicted: Vec<f64>,
}

/// Accuracy against the truth that came with the input.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Accuracy {
    /// Frames in which the target is visible.
    pub visible_frames: u64,
    /// Fraction of them in which it was reported `tracking` with an overlap of at least one half.
    pub followed: f64,
    /// Mean overlap (IoU) of the estimate over the visible frames; a frame reported `lost`, or without a box, counts as 0.
    pub mean_iou: f64,
    /// Mean overlap of the one-step prediction over the frames that have one and a measurement that was believed.
    pub mean_predicted_iou: f64,
    /// Root mean square distance of the estimated centre, pixels, over the frames with a measurement that was believed.
    pub rmse_estimate_px: f64,
    /// The same for the measured centre, over the same frames.
    pub rmse_measured_px: f64,
    /// The same for the predicted centre, over the same frames.
    pub rmse_predicted_px: f64,
    /// Frames in which the target is absent.
    pub absent_frames: u64,
    /// Fraction of them in which it was reported `tracking` all the same.
    pub false_alive: f64,
}

impl AccuracyMeter {
    /// Takes what was said in one frame with the truth of that frame; no record: nothing was said.
    pub fn add(&mut self, record: Option<&Record>, truth: Truth) {
        if truth == Truth::Unknown {
            return;
        }
        let estimate = record.and_then(|r| r.estimate.as_ref());
        let output = estimate.map(Output::from);
        let alive = estimate.is_some_and(|e| e.state == TrackState::Tracking);
        self.judged.push(Judged {
            visible: truth.bbox().is_some(),
            alive,
            overlap: overlap(&truth, believed(output.as_ref())),
            score: output.map_or(0.0, |o| o.score),
        });
        if let (Some(truth), Some(estimate), true) = (truth.bbox(), estimate, alive) {
            self.add_centres(estimate, &truth);
        }
    }

    fn add_centres(&mut self, estimate: &Estimate, truth: &BBox) {
        if let (Some(measured), Some(predicted)) = (estimate.measurement, estimate.prediction) {
            let squared = |point: Point| point.distance(truth.center()).powi(2);
            self.estimate.push(squared(estimate.bbox.center()));
            self.measured.push(squared(measured.center()));
            self.predicted.push(squared(predicted.center()));
            self.predicted_overlaps.push(predicted.iou(truth));
        }
    }

    /// What has been seen so far; `None` without a single frame of known truth.
    pub fn accuracy(&self) -> Option<Accuracy> {
        let overlaps: Vec<f64> = self.judged.iter().filter(|j| j.visible).map(|j| j.overlap).collect();
        let followed = self.judged.iter().filter(|j| j.visible && j.alive && j.overlap >= 0.5).count();
        (!self.judged.is_empty()).then(|| Accuracy {
            visible_frames: overlaps.len() as u64,
            followed: followed as f64 / overlaps.len().max(1) as f64,
            mean_iou: mean(&overlaps),
            mean_predicted_iou: mean(&self.predicted_overlaps),
            rmse_estimate_px: mean(&self.estimate).sqrt(),
            rmse_measured_px: mean(&self.measured).sqrt(),
            rmse_predicted_px: mean(&self.predicted).sqrt(),
            absent_frames: (self.judged.len() - overlaps.len()) as u64,
            false_alive: false_alive(&self.judged).unwrap_or(0.0),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_tracking::TargetId;

    fn record(state: TrackState, left: f64) -> Record {
        let bbox = BBox::from_ltwh(left, 0.0, 10.0, 10.0);
        let (prediction, measurement) = (Some(bbox.translated(3.0, 4.0)), Some(bbox.translated(0.0, 1.0)));
        let estimate = Estimate { state, prediction, measurement, ..Estimate::started(0.0, bbox, 1.0) };
        Record { frame: 0, time_s: 0.0, target: TargetId(1), estimate: Some(estimate), update_ms: None }
    }

    fn meter(frames: &[(Option<Record>, Truth)]) -> Accuracy {
        let mut meter = AccuracyMeter::default();
        frames.iter().for_each(|(record, truth)| meter.add(record.as_ref(), *truth));
        meter.accuracy().unwrap()
    }

    #[test]
    fn figures_are_what_they_say() {
        let truth = Truth::Visible(BBox::from_ltwh(0.0, 0.0, 10.0, 10.0));
        let mut nothing = AccuracyMeter::default();
        assert_eq!(nothing.accuracy(), None);
        nothing.add(Some(&record(TrackState::Tracking, 0.0)), Truth::Unknown);
        assert_eq!(nothing.accuracy(), None);
        let a = meter(&[
            (Some(record(TrackState::Tracking, 0.0)), truth),
            (Some(record(TrackState::Occluded, 0.0)), truth),
            (Some(record(TrackState::Tracking, 6.0)), truth),
            (Some(record(TrackState::Tracking, 50.0)), Truth::Absent),
            (Some(record(TrackState::Lost, 50.0)), Truth::Absent),
            (Some(record(TrackState::Occluded, 50.0)), Truth::Absent),
            (None, Truth::Absent),
            (Some(record(TrackState::Tracking, 0.0)), Truth::Unknown),
        ]);
        assert_eq!((a.visible_frames, a.absent_frames, a.false_alive), (3, 4, 0.25));
        assert!((a.followed - 1.0 / 3.0).abs() < 1e-12, "6 px off is an overlap of a quarter: {a:?}");
        assert!((a.mean_iou - (1.0 + 1.0 + 0.25) / 3.0).abs() < 1e-12, "{a:?}");
        // Of the two frames with a measurement that was believed.
        let rms = |x: f64, y: f64| ((x + y) / 2.0f64).sqrt();
        assert!((a.rmse_estimate_px - rms(0.0, 36.0)).abs() < 1e-12);
        assert!((a.rmse_measured_px - rms(1.0, 37.0)).abs() < 1e-12);
        assert!((a.rmse_predicted_px - rms(25.0, 81.0 + 16.0)).abs() < 1e-12);
        assert!((a.mean_predicted_iou - (42.0 / 158.0 + 6.0 / 194.0) / 2.0).abs() < 1e-12, "{a:?}");
    }

    #[test]
    fn a_lost_frame_has_no_overlap_as_in_an_evaluation() {
        let truth = Truth::Visible(BBox::from_ltwh(0.0, 0.0, 10.0, 10.0));
        let a = meter(&[
            (Some(record(TrackState::Tracking, 0.0)), truth),
            (Some(record(TrackState::Lost, 0.0)), truth),
            (None, truth),
            (Some(Record { estimate: None, ..record(TrackState::Lost, 0.0) }), truth),
        ]);
        assert_eq!((a.mean_iou, a.followed, a.visible_frames), (0.25, 0.25, 4));
        let absent = meter(&[(None, Truth::Absent)]);
        assert_eq!((absent.visible_frames, absent.followed, absent.mean_iou), (0, 0.0, 0.0));
    }
}
