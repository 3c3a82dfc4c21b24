//! What may be the target: a tracker started on a detection, and the evidence for it.

use super::birth::{Nats, RatioTest};
use super::{AcquisitionParams, Elapsed};
use crate::class::Classes;
use crate::{Detection, Estimate, Recipe, Result, TrackState, Tracker};
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use serde::{Deserialize, Serialize};

/// How much speaks for a hypothesis; log-likelihood ratios add up, in nats.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Evidence {
    /// Log-likelihood ratio of *target* against *clutter*.
    pub nats: Nats,
    /// Where it started.
    pub start: BBox,
    /// Whether it has left its place.
    pub moved: bool,
    /// Seconds since it started.
    pub age_s: f64,
}

impl Evidence {
    /// Of a detection seen once.
    pub fn first(detection: &Detection, params: &AcquisitionParams) -> Self {
        let mut evidence = Self { nats: Nats::default(), start: detection.bbox, moved: false, age_s: 0.0 };
        evidence.look(Some(detection), params);
        evidence
    }

    /// A frame in which it was followed to `bbox`.
    pub fn follow(&mut self, bbox: &BBox, dt_s: f64, params: &AcquisitionParams) {
        self.age_s += dt_s;
        let extent = self.start.area().sqrt();
        self.moved |= self.start.center().distance(bbox.center()) > params.moves * extent;
    }

    /// Whether it was detected again: log P(detected | target) − log P(detected | clutter), or the same of not detected.
    pub fn look(&mut self, detection: Option<&Detection>, params: &AcquisitionParams) {
        self.nats.look(detection.map(|d| d.confidence), &self.test(params));
    }

    /// Whether enough speaks for it.
    pub fn is_confirmed(&self, params: &AcquisitionParams) -> bool {
        self.nats.confirm(&self.test(params))
    }

    /// Whether enough speaks against it.
    pub fn is_refuted(&self, params: &AcquisitionParams) -> bool {
        self.nats.refute(&self.test(params))
    }

    fn test(&self, params: &AcquisitionParams) -> RatioTest {
        RatioTest {
            detected: params.detected,
            false_again: if self.moved { params.false_moving } else { params.false_still },
            false_start: params.false_start,
            false_drop: params.false_drop,
        }
    }
}

/// What may be the target.
pub(super) struct Hypothesis {
    pub tracker: Box<dyn Tracker>,
    pub evidence: Evidence,
    /// What its detections were taken for.
    pub classes: Classes,
    /// Where it was followed to last.
    pub bbox: BBox,
    /// What is said of it in this frame, whether it was started in it, and what that took.
    pub answer: Option<Answer>,
}

/// What is said of a hypothesis in one frame.
pub(super) struct Answer {
    pub estimate: Estimate,
    pub started: bool,
    pub elapsed: Elapsed,
}

impl Hypothesis {
    /// Starts a tracker on a detection.
    pub fn start(
        recipe: &dyn Recipe,
        frame: &Frame,
        detection: &Detection,
        params: &AcquisitionParams,
    ) -> Result<Self> {
        let tracker = recipe.init(frame, detection.bbox)?;
        let estimate = Estimate::started(frame.time_s(), detection.bbox, detection.confidence);
        let answer = Some(Answer { estimate, started: true, elapsed: Elapsed::default() });
        let evidence = Evidence::first(detection, params);
        let mut started = Self { tracker, evidence, classes: Classes::default(), bbox: detection.bbox, answer };
        started.count_class(detection);
        Ok(started)
    }

    /// Looks at the next frame.
    pub fn update(&mut self, frame: &Frame, dt_s: f64, params: &AcquisitionParams) -> Result<()> {
        let estimate = self.tracker.update(frame)?;
        self.evidence.follow(&estimate.bbox, dt_s, params);
        self.bbox = estimate.bbox;
        self.answer = Some(Answer { estimate, started: false, elapsed: Elapsed::default() });
        Ok(())
    }

    /// Whether it was detected again in this frame.
    pub fn look(&mut self, detection: Option<&Detection>, params: &AcquisitionParams) {
        self.evidence.look(detection, params);
        detection.into_iter().for_each(|d| self.count_class(d));
    }

    fn count_class(&mut self, detection: &Detection) {
        if let Some(class) = &detection.class {
            self.classes.count(class, detection.confidence);
        }
    }

    /// Whether its own tracker has given it up.
    pub fn is_lost(&self) -> bool {
        self.answer.as_ref().is_some_and(|a| a.estimate.state == TrackState::Lost)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn params() -> AcquisitionParams {
        AcquisitionParams {
            detected: 0.8,
            false_moving: 0.2,
            false_still: 0.6,
            moves: 2.0,
            false_start: 0.01,
            false_drop: 0.05,
            ..AcquisitionParams::default()
        }
    }

    fn seen(confidence: f64) -> Detection {
        Detection::new(BBox::from_ltwh(10.0, 10.0, 4.0, 9.0), confidence)
    }

    #[test]
    fn evidence_is_the_log_likelihood_ratio_of_looks() {
        let p = params();
        let mut evidence = Evidence::first(&seen(0.9), &p);
        assert!((evidence.nats.0 - (0.8f64 * 0.9 / 0.6).ln()).abs() < 1e-12);
        let before = evidence.nats.0;
        evidence.look(None, &p);
        assert!((evidence.nats.0 - before - (0.2f64 / 0.4).ln()).abs() < 1e-12);
        let before = evidence.nats.0;
        evidence.look(Some(&seen(0.0)), &p);
        assert!((evidence.nats.0 - before - (0.2f64 / 0.4).ln()).abs() < 1e-12, "no look says less than a miss");
        evidence.moved = true;
        let before = evidence.nats.0;
        evidence.look(Some(&seen(0.5)), &p);
        assert!((evidence.nats.0 - before - (0.8f64 * 0.5 / 0.2).ln()).abs() < 1e-12);
    }

    #[test]
    fn it_has_moved_once_it_was_two_sizes_away_and_stays_so() {
        let p = params();
        let mut evidence = Evidence::first(&seen(0.9), &p);
        evidence.follow(&seen(0.9).bbox.translated(12.0, 0.0), 0.5, &p);
        assert!(!evidence.moved, "two sizes are 12 px");
        evidence.follow(&seen(0.9).bbox.translated(0.0, -12.1), 0.25, &p);
        assert!(evidence.moved && evidence.age_s == 0.75);
        evidence.follow(&seen(0.9).bbox, 0.25, &p);
        assert!(evidence.moved);
    }

    #[test]
    fn the_thresholds_are_walds() {
        let p = params();
        let mut evidence = Evidence::first(&seen(1.0), &p);
        evidence.moved = true;
        let per_hit = 4.0f64.ln();
        let hits = (((0.95f64 / 0.01).ln() - evidence.nats.0) / per_hit).ceil() as usize;
        for _ in 1..hits {
            evidence.look(Some(&seen(1.0)), &p);
        }
        assert!(!evidence.is_confirmed(&p));
        evidence.look(Some(&seen(1.0)), &p);
        assert!(evidence.is_confirmed(&p) && !evidence.is_refuted(&p));
        for _ in 0..20 {
            evidence.look(None, &p);
        }
        assert!(evidence.is_refuted(&p) && !evidence.is_confirmed(&p));
        assert_eq!(evidence.nats.0, (0.05f64 / 0.99).ln(), "what speaks against it does not pile up");
    }
}
