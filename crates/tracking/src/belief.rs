//! What is believed of a target, whoever follows it: predict, judge, apply, report.

use crate::motion::{Motion, MotionFilter, MotionParams, Sight};
use crate::policy::{Evidence, Policy, PolicyParams, Verdict};
use crate::{Diagnostics, Doubt, Estimate, Forecast, Measurement, Prior, Result, TrackState, TrackingError};
use pursuit_estimation::EstimationError;
use pursuit_geometry::{BBox, Point, Size};
use pursuit_imaging::Frame;
use serde::{Deserialize, Serialize};

/// Time that stands still or runs backwards (flaky cameras do that) counts as this many seconds.
const SHORTEST_STEP_S: f64 = 1e-3;

/// Number, time and size of a frame: all that is needed of it where nobody looks at pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stamp {
    pub index: u64,
    pub time_s: f64,
    pub size: Size,
}

impl From<&Frame> for Stamp {
    fn from(frame: &Frame) -> Self {
        Self { index: frame.index(), time_s: frame.time_s(), size: frame.size() }
    }
}

/// The time of the frame seen last, and the size that frames must have.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct LastFrame {
    pub time_s: f64,
    width: usize,
    height: usize,
}

impl LastFrame {
    pub fn of(frame: impl Into<Stamp>) -> Self {
        let Stamp { time_s, size, .. } = frame.into();
        Self { time_s, width: size.width, height: size.height }
    }

    /// Goes on to `frame` after checking that its size agrees. Returns the seconds from the last frame, > 0.
    pub fn advance(&mut self, frame: impl Into<Stamp>) -> Result<f64> {
        let Stamp { index, time_s, size } = frame.into();
        let expected = Size::new(self.width, self.height);
        if size != expected {
            return Err(TrackingError::FrameSize { index, expected, actual: size });
        }
        let dt_s = time_s - self.time_s;
        if time_s.is_finite() {
            self.time_s = time_s;
        }
        // Written so that NaN counts as the shortest step.
        Ok(if dt_s >= SHORTEST_STEP_S { dt_s } else { SHORTEST_STEP_S })
    }

    /// The same, where `frame` may be the first.
    pub fn start_or_advance(last: &mut Option<Self>, frame: &Frame) -> Result<f64> {
        match last {
            Some(last) => last.advance(frame),
            None => {
                *last = Some(Self::of(frame));
                Ok(SHORTEST_STEP_S)
            }
        }
    }
}

/// What a policy says of a frame, and why the target is not tracked if it is not.
pub(crate) type Judgement = (Verdict, Option<Doubt>);

/// What is believed of a target, whoever looks for it: its motion, whether it is seen, and since when.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Belief {
    pub(crate) motion: Motion,
    pub(crate) policy: Policy,
    pub(crate) state: TrackState,
    /// The box reported when it was seen last.
    pub(crate) last_believed: BBox,
    pub(crate) last: LastFrame,
}

impl Belief {
    /// Of a target that was just seen at `bbox` of `frame`.
    ///
    /// # Errors
    /// When the motion model cannot start from the box.
    pub(crate) fn new(
        motion: &MotionParams,
        policy: &PolicyParams,
        frame: impl Into<Stamp>,
        bbox: BBox,
    ) -> Result<Self, EstimationError> {
        Ok(Self {
            motion: Motion::new(motion.clone(), bbox)?,
            policy: Policy::new(policy.clone()),
            state: TrackState::Tracking,
            last_believed: bbox,
            last: LastFrame::of(frame),
        })
    }

    /// Somebody else says that the target is at `bbox` of `frame`.
    pub(crate) fn restart(&mut self, frame: impl Into<Stamp>, bbox: BBox) {
        self.motion.restart(bbox);
        self.policy.restart();
        self.state = TrackState::Tracking;
        self.last_believed = bbox;
        self.last = LastFrame::of(frame);
    }

    /// Moves what is believed with the picture, which the camera's motion moved by `(dx, dy)` pixels.
    pub(crate) fn carry(&mut self, (dx, dy): (f64, f64)) {
        self.motion.carry((dx, dy));
        self.last_believed = self.last_believed.translated(dx, dy);
    }

    /// Where it should be after `dt_s` seconds.
    ///
    /// # Errors
    /// When the step cannot be computed.
    pub(crate) fn predict(&mut self, dt_s: f64) -> Result<Prior, EstimationError> {
        self.motion.predict(dt_s)
    }

    /// Moves a target that is not seen back to where it is at most `outside` of its sizes out of the picture, unless that is 0: what
    /// left the picture is beside it, however fast it went.
    pub(crate) fn keep_near(&mut self, frame: Size, outside: f64, mut prior: Prior) -> Prior {
        if outside <= 0.0 || self.state == TrackState::Tracking {
            return prior;
        }
        let (w, h) = (outside * prior.bbox.width(), outside * prior.bbox.height());
        let back = |least: f64, most: f64, length: usize, room: f64| {
            if most < -room { -room - most } else { (length as f64 + room - least).min(0.0) }
        };
        let dx = back(prior.bbox.left(), prior.bbox.right(), frame.width, w);
        let dy = back(prior.bbox.top(), prior.bbox.bottom(), frame.height, h);
        if (dx, dy) != (0.0, 0.0) {
            self.motion.carry((dx, dy));
            prior.bbox = prior.bbox.translated(dx, dy);
        }
        prior
    }

    /// What the policy says of what was found, and why the target is not tracked if it is not; `hidden` is asked why one is
    /// not seen that should be in the picture. `follows` says whether what is found in doubt moves the box where the policy says
    /// so: where it does not, the box coasts.
    pub(crate) fn judge(
        &mut self,
        frame: Size,
        prior: &Prior,
        found: Option<&Measurement>,
        follows: bool,
        hidden: impl FnOnce() -> Option<Doubt>,
    ) -> Judgement {
        let evidence = Evidence { frame, prior, found, state: self.state };
        let mut verdict = within_reach(self.policy.judge(&evidence), frame, prior, found);
        let doubt = evidence.doubt(verdict.state, hidden);
        let visible = follows && found.is_some_and(|f| f.bbox.clipped_to(frame).is_some());
        if verdict.state == TrackState::Unsure && (!visible || is_hidden(doubt)) {
            verdict.state = TrackState::Occluded;
        }
        (verdict, doubt)
    }

    /// Corrects the motion by a measurement that is the target. It stands for those of `shared`, where there are any, which
    /// are the target's each with its probability. Of a target that was lost, or that is `elsewhere`, what was believed of its
    /// motion says nothing about where it is now.
    ///
    /// # Errors
    /// When the step cannot be computed; the belief is then as before.
    pub(crate) fn believe(
        &mut self,
        found: &Measurement,
        shared: &[(Sight, f64)],
        elsewhere: bool,
    ) -> Result<(), EstimationError> {
        if self.state == TrackState::Lost || elsewhere {
            self.motion.restart(found.bbox);
        } else if shared.is_empty() {
            self.motion.correct(&Sight::from(found))?;
        } else {
            self.motion.correct_shared(shared)?;
        }
        self.last_believed = self.motion.bbox();
        Ok(())
    }

    /// What is said of the target once it was judged and believed.
    #[inline]
    pub(crate) fn report(
        &mut self,
        frame: impl Into<Stamp>,
        prior: &Prior,
        (verdict, doubt): Judgement,
        found: Option<&Measurement>,
    ) -> Estimate {
        self.state = verdict.state;
        let lost = verdict.state == TrackState::Lost;
        Estimate {
            time_s: frame.into().time_s,
            bbox: match verdict.state {
                TrackState::Unsure | TrackState::Occluded => self.motion.bbox(),
                TrackState::Tracking | TrackState::Lost => self.last_believed,
            },
            score: verdict.score.clamp(0.0, 1.0),
            state: verdict.state,
            doubt,
            prediction: Some(prior.bbox),
            measurement: found.map(|m| m.bbox),
            searched: None,
            covariance: self.motion.covariance(),
            velocity: self.motion.velocity().filter(|_| !lost),
            next: self.motion.next_sample(),
            mask: None,
            diagnostics: Diagnostics::default(),
        }
    }

    /// Where the target will be `seconds` after the frame seen last.
    ///
    /// # Errors
    /// When the motion model cannot be stepped that far.
    pub(crate) fn forecast(&self, seconds: f64) -> Result<Forecast, EstimationError> {
        let forecast = self.motion.forecast(self.last.time_s, seconds)?;
        let filtered = self.motion.bbox();
        if self.state != TrackState::Tracking || self.last_believed == filtered {
            return Ok(forecast);
        }
        // The box reported is the measured one: the filtered motion goes on from there.
        let (from, now, ahead) = (self.last_believed.center(), filtered.center(), forecast.bbox.center());
        let center = Point::new(from.x + ahead.x - now.x, from.y + ahead.y - now.y);
        let grown = forecast.bbox.width() / filtered.width();
        let (width, height) = (self.last_believed.width() * grown, self.last_believed.height() * grown);
        let bbox = if seconds > 0.0 { BBox::from_center_size(center, width, height) } else { self.last_believed };
        Ok(Forecast { bbox, ..forecast })
    }

    /// Goes on with other parameters.
    ///
    /// # Errors
    /// When the motion model cannot start from the box believed now; everything is then as before.
    pub(crate) fn change(&mut self, motion: &MotionParams, policy: &PolicyParams) -> Result<(), EstimationError> {
        if self.motion.params() != motion {
            self.motion.change(motion.clone())?;
        }
        self.policy.change(policy.clone());
        Ok(())
    }
}

/// What no policy may say: that a target outside of the picture was measured there, or that one coasted out of the
/// picture's neighbourhood (long unseen, or after a gap in time) is merely unsure or occluded. Nobody can search for it there, and
/// nobody should steer by it.
fn within_reach(verdict: Verdict, frame: Size, prior: &Prior, found: Option<&Measurement>) -> Verdict {
    let outside = || found.is_none_or(|f| f.bbox.clipped_to(frame).is_none());
    let state = if verdict.state == TrackState::Tracking && outside() { TrackState::Occluded } else { verdict.state };
    let doubted = matches!(state, TrackState::Unsure | TrackState::Occluded);
    let reach = || frame.bounds().expanded(frame.width.max(frame.height) as f64);
    let astray = doubted && !reach().contains(prior.bbox.center());
    let state = if astray { TrackState::Lost } else { state };
    if state == verdict.state { verdict } else { Verdict { state, score: 0.0, follow: false, learn: false } }
}

/// Whether this reason says that the target cannot be seen where it is.
const fn is_hidden(doubt: Option<Doubt>) -> bool {
    match doubt {
        Some(Doubt::Covered | Doubt::Gone) => true,
        Some(Doubt::Changed | Doubt::Confused) | None => false,
    }
}

/// Says of an error of the motion model whose it is.
pub(crate) fn failed(owner: &str, index: u64, source: EstimationError) -> TrackingError {
    TrackingError::Computation { tracker: owner.to_owned(), index, source: Box::new(source) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_left_the_picture_stays_beside_it() {
        let frame = Size::new(100, 80);
        let at = |left: f64, top: f64| BBox::from_ltwh(left, top, 10.0, 8.0);
        let near = |bbox: BBox, state: TrackState, outside: f64| {
            let (motion, policy) = (MotionParams::default(), PolicyParams::default());
            let mut belief = Belief::new(&motion, &policy, Stamp { index: 0, time_s: 0.0, size: frame }, bbox).unwrap();
            belief.state = state;
            let prior = belief.predict(1e-6).unwrap();
            let kept = belief.keep_near(frame, outside, prior).bbox;
            assert!(belief.motion.bbox().center().distance(kept.center()) < 1e-6, "what is believed goes along");
            (kept.left().round(), kept.top().round())
        };
        assert_eq!(near(at(150.0, 30.0), TrackState::Occluded, 1.0), (110.0, 30.0));
        assert_eq!(near(at(-60.0, -40.0), TrackState::Occluded, 1.0), (-20.0, -16.0));
        assert_eq!(near(at(105.0, 30.0), TrackState::Occluded, 1.0), (105.0, 30.0), "less than its size outside");
        assert_eq!(near(at(150.0, 30.0), TrackState::Occluded, 0.0), (150.0, 30.0));
        assert_eq!(near(at(150.0, 30.0), TrackState::Tracking, 1.0), (150.0, 30.0));
    }
}
