//! Accuracy against the truth, accumulated frame by frame in constant memory: the figures of a run's record.

use crate::{Output, Truth};
use pursuit_geometry::{BBox, Point};
use pursuit_tracking::{Estimate, TrackState};
use serde::{Deserialize, Serialize};

/// The box that a frame is scored by, everywhere: none where the tracker says that it lost the target, or says nothing.
pub fn believed(output: Option<&Output>) -> Option<BBox> {
    output.filter(|o| o.state != TrackState::Lost).map(|o| o.bbox)
}

/// Overlap (intersection over union) of the [`believed`] box with the truth, in `[0, 1]`; 0 where either is missing.
pub fn overlap(truth: &Truth, output: Option<&Output>) -> f64 {
    truth.bbox().zip(believed(output)).map_or(0.0, |(t, b)| t.iou(&b))
}

/// Whether the box reported, whatever the state, overlaps the target by at least one half: what `score` is the
/// probability of.
pub fn is_hit(truth: &Truth, output: &Output) -> bool {
    truth.bbox().is_some_and(|t| t.iou(&output.bbox) >= 0.5)
}

/// Compares estimates with the truth, frame by frame, in constant memory. Boxes and states count exactly as in
/// [`evaluate`](crate::evaluate), and so do frames if those on which a tracker was started are left out: their box was given.
///
/// ```
/// use pursuit_evaluation::metrics::accuracy::AccuracyMeter;
/// use pursuit_evaluation::Truth;
/// use pursuit_geometry::BBox;
///
/// let mut meter = AccuracyMeter::default();
/// meter.add(Truth::Visible(BBox::from_ltwh(10.0, 10.0, 20.0, 20.0)), None);
/// meter.add(Truth::Unknown, None);
/// let accuracy = meter.accuracy().ok_or("no frame of known truth")?;
/// assert_eq!((accuracy.visible_frames, accuracy.mean_iou), (1, 0.0), "silence is no overlap");
/// # Ok::<(), &str>(())
/// ```
#[derive(Debug, Clone, Default)]
pub struct AccuracyMeter {
    estimate: SquaredError,
    measured: SquaredError,
    predicted: SquaredError,
    overlap_sum: f64,
    predicted_overlap_sum: f64,
    visible: u64,
    followed: u64,
    absent: u64,
    falsely_tracking: u64,
}

/// Accuracy against the truth that came with an input.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Accuracy {
    /// Frames in which the target is visible.
    pub visible_frames: u64,
    /// Fraction of them in which it was reported `tracking` with an overlap of at least one half.
    pub followed: f64,
    /// Mean overlap (IoU) over the visible frames; 0 in frames reported `lost` or without an estimate.
    pub mean_iou: f64,
    /// Mean overlap of the one-step prediction, over the frames with a measurement that was believed.
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
    /// Takes what was said about one frame (`None`: nothing) and what is true of it.
    pub fn add(&mut self, truth: Truth, estimate: Option<&Estimate>) {
        let output = estimate.map(Output::from);
        let tracking = estimate.filter(|e| e.state == TrackState::Tracking);
        match truth {
            Truth::Unknown => {}
            Truth::Absent => {
                self.absent += 1;
                self.falsely_tracking += u64::from(tracking.is_some());
            }
            Truth::Visible(bbox) => {
                self.visible += 1;
                self.overlap_sum += overlap(&truth, output.as_ref());
                if let (Some(estimate), Some(output)) = (tracking, output) {
                    self.followed += u64::from(is_hit(&truth, &output));
                    self.add_centers(estimate, &bbox);
                }
            }
        }
    }

    fn add_centers(&mut self, estimate: &Estimate, truth: &BBox) {
        if let (Some(measured), Some(predicted)) = (estimate.measurement, estimate.prediction) {
            self.estimate.add(estimate.bbox.center(), truth.center());
            self.measured.add(measured.center(), truth.center());
            self.predicted.add(predicted.center(), truth.center());
            self.predicted_overlap_sum += predicted.iou(truth);
        }
    }

    /// What has been seen so far; `None` without a single frame of known truth. Means over no frames are 0.
    pub fn accuracy(&self) -> Option<Accuracy> {
        let fraction = |part: f64, whole: u64| part / whole.max(1) as f64;
        (self.visible + self.absent > 0).then(|| Accuracy {
            visible_frames: self.visible,
            followed: fraction(self.followed as f64, self.visible),
            mean_iou: fraction(self.overlap_sum, self.visible),
            mean_predicted_iou: fraction(self.predicted_overlap_sum, self.predicted.count),
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
        (self.sum / self.count.max(1) as f64).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn truth() -> Truth {
        Truth::Visible(BBox::from_ltwh(0.0, 0.0, 10.0, 10.0))
    }

    /// A box `left` pixels beside the truth, with a prediction 5 px and a measurement 1 px from it.
    fn estimate(state: TrackState, left: f64) -> Estimate {
        let bbox = BBox::from_ltwh(left, 0.0, 10.0, 10.0);
        let (prediction, measurement) = (Some(bbox.translated(3.0, 4.0)), Some(bbox.translated(0.0, 1.0)));
        Estimate { state, prediction, measurement, ..Estimate::started(0.0, bbox, 1.0) }
    }

    fn after(frames: &[(Truth, Option<Estimate>)]) -> Option<Accuracy> {
        let mut meter = AccuracyMeter::default();
        frames.iter().for_each(|(truth, estimate)| meter.add(*truth, estimate.as_ref()));
        meter.accuracy()
    }

    #[test]
    fn unknown_truth_gives_no_figures() {
        assert_eq!(after(&[]), None);
        assert_eq!(after(&[(Truth::Unknown, Some(estimate(TrackState::Tracking, 0.0)))]), None);
        let absent = after(&[(Truth::Absent, None)]).unwrap();
        let expected = Accuracy { absent_frames: 1, ..ZERO };
        assert_eq!(absent, expected);
    }

    const ZERO: Accuracy = Accuracy {
        visible_frames: 0,
        followed: 0.0,
        mean_iou: 0.0,
        mean_predicted_iou: 0.0,
        rmse_estimate_px: 0.0,
        rmse_measured_px: 0.0,
        rmse_predicted_px: 0.0,
        absent_frames: 0,
        false_alive: 0.0,
    };

    #[test]
    fn every_figure_is_the_mean_it_says() {
        use TrackState::{Lost, Occluded, Tracking, Unsure};
        let unbelieved = Estimate { measurement: None, ..estimate(Tracking, 0.0) };
        let a = after(&[
            (truth(), Some(estimate(Tracking, 0.0))),
            (truth(), Some(estimate(Tracking, 2.0))),
            (truth(), Some(estimate(Tracking, 5.0))), // overlap 1/3: tracking, yet not followed
            (truth(), Some(estimate(Occluded, 0.0))), // counts by its box, is not followed
            (truth(), Some(estimate(Unsure, 0.0))),   // likewise
            (truth(), Some(estimate(Lost, 0.0))),     // on the target, yet said to be lost: no box
            (truth(), None),
            (truth(), Some(unbelieved)),
            (Truth::Absent, Some(estimate(Tracking, 0.0))),
            (Truth::Absent, Some(estimate(Occluded, 0.0))),
            (Truth::Absent, Some(estimate(Unsure, 0.0))),
            (Truth::Absent, Some(estimate(Lost, 0.0))),
            (Truth::Absent, None),
            (Truth::Unknown, Some(estimate(Tracking, 0.0))),
        ])
        .unwrap();
        assert_eq!((a.visible_frames, a.absent_frames, a.false_alive), (8, 5, 0.2));
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
        near(a.followed, 3.0 / 8.0);
        near(a.mean_iou, (1.0 + 8.0 / 12.0 + 5.0 / 15.0 + 1.0 + 1.0 + 1.0) / 8.0);
        // Over the three frames with a believed measurement: predictions at (3, 4), (5, 4), (8, 4).
        near(a.mean_predicted_iou, (42.0 / 158.0 + 30.0 / 170.0 + 12.0 / 188.0) / 3.0);
        near(a.rmse_estimate_px, ((4.0 + 25.0) / 3.0f64).sqrt());
        near(a.rmse_measured_px, ((1.0 + 5.0 + 26.0) / 3.0f64).sqrt());
        near(a.rmse_predicted_px, ((25.0 + 41.0 + 80.0) / 3.0f64).sqrt());
    }

    #[test]
    fn half_an_overlap_is_a_hit() {
        let output = |height, state| Output { bbox: BBox::from_ltwh(0.0, 0.0, 10.0, height), state, score: 0.5 };
        assert!(is_hit(&truth(), &output(5.0, TrackState::Lost)), "exactly one half");
        assert!(!is_hit(&truth(), &output(4.9, TrackState::Tracking)));
        assert!(!is_hit(&Truth::Absent, &output(5.0, TrackState::Tracking)));
        assert_eq!(overlap(&truth(), Some(&output(5.0, TrackState::Lost))), 0.0);
        for in_doubt in [TrackState::Unsure, TrackState::Occluded] {
            assert_eq!(overlap(&truth(), Some(&output(5.0, in_doubt))), 0.5);
        }
        assert_eq!(believed(Some(&output(5.0, TrackState::Lost))), None);
        assert_eq!(believed(None), None);
    }
}
