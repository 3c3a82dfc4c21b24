//! How well a run did, where the input came with the truth.

use crate::Record;
use pursuit_geometry::{BBox, Point};
use pursuit_media::Truth;
use pursuit_tracking::{Estimate, TrackState};
use serde::Serialize;

/// Compares records with the truth, frame by frame, in constant memory.
#[derive(Debug, Clone, Default)]
pub struct AccuracyMeter {
    estimate: SquaredError,
    measured: SquaredError,
    predicted: SquaredError,
    iou_sum: f64,
    predicted_iou_sum: f64,
    visible: u64,
    followed: u64,
    absent: u64,
    falsely_tracking: u64,
}

/// Accuracy against the truth that came with the input.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Accuracy {
    /// Frames in which the target is visible.
    pub visible_frames: u64,
    /// Fraction of them in which it was reported `tracking` with an overlap of at least one half.
    pub followed: f64,
    /// Mean overlap (IoU) of the estimate over the visible frames.
    pub mean_iou: f64,
    /// Mean overlap of the one-step prediction over the frames that have one.
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
    /// Takes the record of one frame with the truth of that frame.
    pub fn add(&mut self, record: &Record, truth: Truth) {
        let tracking = record.estimate.as_ref().filter(|e| e.state == TrackState::Tracking);
        match truth {
            Truth::Unknown => {}
            Truth::Absent => {
                self.absent += 1;
                self.falsely_tracking += u64::from(tracking.is_some());
            }
            Truth::Visible(bbox) => {
                self.visible += 1;
                if let Some(estimate) = &record.estimate {
                    self.iou_sum += estimate.bbox.iou(&bbox);
                }
                if let Some(estimate) = tracking {
                    self.followed += u64::from(estimate.bbox.iou(&bbox) >= 0.5);
                    self.add_centres(estimate, &bbox);
                }
            }
        }
    }

    fn add_centres(&mut self, estimate: &Estimate, truth: &BBox) {
        if let (Some(measured), Some(predicted)) = (estimate.measurement, estimate.prediction) {
            self.estimate.add(estimate.bbox.center(), truth.center());
            self.measured.add(measured.center(), truth.center());
            self.predicted.add(predicted.center(), truth.center());
            self.predicted_iou_sum += predicted.iou(truth);
        }
    }

    /// What has been seen so far; `None` without a single frame of known truth.
    pub fn accuracy(&self) -> Option<Accuracy> {
        let fraction = |part: f64, whole: u64| if whole > 0 { part / whole as f64 } else { 0.0 };
        (self.visible + self.absent > 0).then(|| Accuracy {
            visible_frames: self.visible,
            followed: fraction(self.followed as f64, self.visible),
            mean_iou: fraction(self.iou_sum, self.visible),
            mean_predicted_iou: fraction(self.predicted_iou_sum, self.predicted.count),
            rmse_estimate_px: self.estimate.rmse(),
            rmse_measured_px: self.measured.rmse(),
            rmse_predicted_px: self.predicted.rmse(),
            absent_frames: self.absent,
            false_alive: fraction(self.falsely_tracking as f64, self.absent),
        })
    }
}

#[derive(Debug, Clone, Copy, Default)]
struct SquaredError {
    sum: f64,
    count: u64,
}

impl SquaredError {
    fn add(&mut self, a: Point, b: Point) {
        self.sum += a.distance(b).powi(2);
        self.count += 1;
    }

    fn rmse(&self) -> f64 {
        if self.count > 0 { (self.sum / self.count as f64).sqrt() } else { 0.0 }
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

    #[test]
    fn figures_are_what_they_say() {
        let truth = Truth::Visible(BBox::from_ltwh(0.0, 0.0, 10.0, 10.0));
        let mut meter = AccuracyMeter::default();
        assert_eq!(meter.accuracy(), None);
        meter.add(&record(TrackState::Tracking, 0.0), truth);
        meter.add(&record(TrackState::Occluded, 0.0), truth);
        meter.add(&record(TrackState::Tracking, 50.0), Truth::Absent);
        meter.add(&record(TrackState::Lost, 50.0), Truth::Absent);
        meter.add(&record(TrackState::Tracking, 0.0), Truth::Unknown);
        let a = meter.accuracy().unwrap();
        assert_eq!((a.visible_frames, a.absent_frames, a.followed, a.false_alive, a.mean_iou), (2, 2, 0.5, 0.5, 1.0));
        assert_eq!((a.rmse_estimate_px, a.rmse_measured_px, a.rmse_predicted_px), (0.0, 1.0, 5.0));
    }
}
