//! What a target was given lately: the boxes themselves, and its motion when it was seen last.

use super::association::ObservationParams;
use crate::Prior;
use crate::motion::{Motion, MotionFilter, Sight};
use pursuit_estimation::EstimationError;
use pursuit_geometry::{BBox, Point};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// How many boxes are kept: directions are measured over few frames.
const KEPT: usize = 16;

/// Steps by which a gap is gone through again at most: long ones are gone through in longer steps.
const MOST_STEPS: usize = 64;

/// A box, and the number of the frame in which it was seen.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Seen {
    frame: usize,
    bbox: BBox,
}

/// The boxes that a target was given, and its motion at the last of them (cao2023: observation-centric).
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Observed {
    /// The number of this frame, counted from the first box on.
    frame: usize,
    /// The oldest first.
    boxes: VecDeque<Seen>,
    /// Its motion as corrected by the last box; kept where gaps are gone through again.
    motion: Option<Box<Motion>>,
}

impl Observed {
    /// A further frame; `motion` is that of the frame before, where the target was seen in it.
    pub fn wait(&mut self, motion: Option<Box<Motion>>) {
        self.frame = self.frame.saturating_add(1);
        self.motion = motion.or(self.motion.take());
    }

    /// It was given a box in this frame; its motion when it was seen last is no longer needed.
    pub fn see(&mut self, bbox: BBox) -> Option<Box<Motion>> {
        if self.boxes.len() == KEPT {
            self.boxes.pop_front();
        }
        self.boxes.push_back(Seen { frame: self.frame, bbox });
        self.motion.take()
    }

    /// How many frames ago a box was seen.
    const fn ago(&self, seen: &Seen) -> usize {
        self.frame.saturating_sub(seen.frame)
    }

    /// The camera's motion moved the picture by so many pixels.
    pub fn carry(&mut self, (dx, dy): (f64, f64)) {
        self.boxes.iter_mut().for_each(|seen| seen.bbox = seen.bbox.translated(dx, dy));
        if let Some(motion) = &mut self.motion {
            motion.carry((dx, dy));
        }
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.boxes.clear();
        self.motion = None;
    }

    /// The last box.
    pub fn last(&self) -> Option<&BBox> {
        self.boxes.back().map(|seen| &seen.bbox)
    }

    /// Whether its motion was kept, so that it can be taken through a gap again.
    pub const fn keeps_motion(&self) -> bool {
        self.motion.is_some()
    }

    /// Whether it was given one box so far.
    pub fn is_first(&self) -> bool {
        self.boxes.len() == 1
    }

    /// In how many frames it was seen, one after the other up to this one, since it was missed; `None` where it was not missed lately.
    pub fn since_gap(&self) -> Option<usize> {
        let seen = self.boxes.iter().rev().zip(0..).take_while(|(seen, ago)| self.ago(seen) == *ago).count();
        (seen < self.boxes.len()).then_some(seen)
    }

    /// How well a box agrees with the direction in which the target went (cao2023, section 4.2): from 0.5, straight on, to −0.5, back. The target went from
    /// the box `lag` frames before its last one to that one, and would go from the box `lag` frames ago to this one; where there is no box so lately, from the
    /// one before.
    pub fn agreement(&self, bbox: &BBox, lag: usize) -> Option<f64> {
        let last = self.boxes.back()?;
        let before = || self.boxes.iter().take(self.boxes.len() - 1);
        let from = before().find(|seen| last.frame - seen.frame <= lag).or(before().next_back())?;
        let here = self.boxes.iter().find(|seen| self.ago(seen) <= lag).unwrap_or(last);
        let direction = |from: Point, to: Point| {
            let moved = to.distance(from) >= 1e-6;
            moved.then(|| (to.y - from.y).atan2(to.x - from.x))
        };
        let went = direction(from.bbox.center(), last.bbox.center())?;
        let would_go = direction(here.bbox.center(), bbox.center())?;
        let turned = (went - would_go).abs();
        let turned = turned.min(std::f64::consts::TAU - turned);
        Some(0.5 - turned / std::f64::consts::PI)
    }

    /// The motion that it would have had if it had been seen all along a straight line, from the last box to `bbox`, which is seen now (cao2023, section 4.1:
    /// observation-centric re-update), and what that motion expects of this frame. `None` where there was no gap.
    ///
    /// # Errors
    /// When a step cannot be computed.
    pub fn again(&self, bbox: &BBox, unseen_s: f64) -> Result<Option<(Motion, Prior)>, EstimationError> {
        let (Some(motion), Some(last)) = (&self.motion, self.boxes.back()) else { return Ok(None) };
        let missed = self.ago(last).saturating_sub(1).min(MOST_STEPS);
        if missed == 0 || !(unseen_s.is_finite() && unseen_s > 0.0) {
            return Ok(None);
        }
        let mut motion = (**motion).clone();
        let dt_s = unseen_s / (missed + 1) as f64;
        let between = |share: f64, a: f64, b: f64| a + share * (b - a);
        for step in 1..=missed {
            let share = step as f64 / (missed + 1) as f64;
            let (from, to) = (&last.bbox, bbox);
            let center = Point::new(
                between(share, from.center().x, to.center().x),
                between(share, from.center().y, to.center().y),
            );
            let size = (between(share, from.width(), to.width()), between(share, from.height(), to.height()));
            motion.predict(dt_s)?;
            motion.correct(&Sight::of(BBox::from_center_size(center, size.0, size.1), None))?;
        }
        let prior = motion.predict(dt_s)?;
        // The end of the line is a part of it, and is what is seen: it counts twice.
        motion.correct(&Sight::of(*bbox, None))?;
        Ok(Some((motion, prior)))
    }

    /// Whether it can be known: what is restored is checked.
    pub fn is_sound(&self) -> bool {
        let next = self.boxes.iter().skip(1);
        let in_order = self.boxes.iter().zip(next).all(|(seen, next)| seen.frame < next.frame);
        let before_now = self.boxes.back().is_none_or(|last| last.frame <= self.frame);
        in_order && before_now && self.boxes.len() <= KEPT && self.boxes.iter().all(|seen| seen.bbox.is_finite())
    }
}

/// Whether gaps are gone through again.
pub(super) fn goes_again(params: &super::AssociationParams) -> bool {
    let ObservationParams { update_again, .. } = params.observation;
    params.model == super::AssociationModel::Observation && update_again
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::MotionParams;

    fn at(x: f64, y: f64) -> BBox {
        BBox::from_ltwh(x, y, 20.0, 40.0)
    }

    fn walked() -> Observed {
        let mut observed = Observed::default();
        for k in 0..30 {
            observed.wait(None);
            observed.see(at(3.0 * f64::from(k), 50.0));
        }
        observed
    }

    #[test]
    fn straight_on_agrees_and_back_does_not() {
        let observed = walked();
        let agrees = |bbox| observed.agreement(&bbox, 3).unwrap();
        assert!((agrees(at(93.0, 50.0)) - 0.5).abs() < 1e-12);
        assert!((agrees(at(60.0, 50.0)) + 0.5).abs() < 1e-12, "the start is 78, three frames back");
        assert!(agrees(at(78.0, 90.0)).abs() < 1e-12, "to the side");
        assert_eq!(observed.agreement(&at(78.0, 50.0), 3), None, "where it came from there is no direction");
        assert_eq!(Observed::default().agreement(&at(0.0, 0.0), 3), None);
        assert!(observed.is_sound() && observed.boxes.len() == KEPT);
    }

    #[test]
    fn the_lag_counts_frames_and_not_boxes() {
        let mut observed = Observed::default();
        observed.see(at(0.0, 0.0));
        (0..10).for_each(|_| observed.wait(None));
        observed.see(at(50.0, 0.0));
        observed.wait(None);
        observed.see(at(50.0, 10.0));
        // The oldest box is eleven frames before the last one: it is no part of the direction.
        assert!(observed.agreement(&at(50.0, 30.0), 3).unwrap() > 0.49);
        assert!(observed.agreement(&at(50.0, 30.0), 11).unwrap() < 0.49);
    }

    #[test]
    fn a_gap_is_gone_through_along_a_line() {
        let params = MotionParams { start_speed: 10.0, ..MotionParams::default() };
        let mut motion = Motion::new(params, at(0.0, 0.0)).unwrap();
        for k in 1..20 {
            motion.predict(0.1).unwrap();
            motion.correct(&Sight::of(at(4.0 * f64::from(k), 0.0), None)).unwrap();
        }
        let mut observed = Observed::default();
        observed.see(at(76.0, 0.0));
        assert_eq!(observed.again(&at(80.0, 0.0), 0.1).unwrap(), None, "there was no gap");
        // Unseen for nine frames it went down, not on.
        (0..10).for_each(|k| observed.wait((k == 0).then(|| Box::new(motion.clone()))));
        let (again, prior) = observed.again(&at(76.0, 50.0), 1.0).unwrap().unwrap();
        let velocity = again.velocity().unwrap();
        assert!(velocity.x.abs() < 8.0 && (velocity.y - 50.0).abs() < 8.0, "{velocity:?}");
        assert!(prior.bbox.center().distance(at(76.0, 50.0).center()) < 4.0, "{:?}", prior.bbox);
        let mut blind = motion.clone();
        blind.predict(1.0).unwrap();
        blind.correct(&Sight::of(at(76.0, 50.0), None)).unwrap();
        assert!((blind.velocity().unwrap().y - 50.0).abs() > (velocity.y - 50.0).abs(), "as if it had been seen");
        (0..1_000_000).for_each(|_| observed.wait(None));
        assert!(observed.again(&at(76.0, 50.0), 1e5).unwrap().is_some(), "long gaps take no more steps");
    }
}
