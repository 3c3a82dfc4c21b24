use crate::roles::{Evidence, Localizer, Measurement, MotionFilter, Policy, Prior, Proposer, Verdict};
use crate::{Estimate, Result, TrackState, Tracker, TrackingError, check_box, snapshot};
use pursuit_geometry::{BBox, Size};
use pursuit_imaging::Frame;
use serde::{Deserialize, Serialize, de::DeserializeOwned};

/// Time that stands still or runs backwards (flaky cameras do that) counts as this many seconds.
const SHORTEST_STEP_S: f64 = 1e-3;

/// The one loop: predict → search → judge → correct or coast → learn.
///
/// Each clause has one owner: `R` proposes where to look, `L` finds, `P` judges, `M` predicts and corrects, and
/// appearance learns only when the policy says `Tracking`.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct SingleTarget<R, L, P, M> {
    name: Name,
    proposer: R,
    localizer: L,
    policy: P,
    motion: M,
    state: TrackState,
    last_believed: BBox,
    frame_size: (usize, usize),
    time_s: f64,
}

/// A registry name; saved as nothing, since the snapshot's header holds it.
#[derive(Debug, Clone, Copy, Default)]
struct Name(&'static str);

impl Serialize for Name {
    fn serialize<S: serde::Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
        s.serialize_unit()
    }
}

impl<'de> Deserialize<'de> for Name {
    fn deserialize<D: serde::Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        <()>::deserialize(d).map(|()| Self::default())
    }
}

impl<R: Proposer, L: Localizer, P: Policy, M: MotionFilter> SingleTarget<R, L, P, M> {
    /// A loop that has been started: `localizer` and `motion` know the target of `frame`.
    pub fn new(name: &'static str, frame: &Frame, proposer: R, localizer: L, policy: P, motion: M) -> Self {
        let Size { width, height } = frame.size();
        Self {
            name: Name(name),
            proposer,
            localizer,
            policy,
            last_believed: motion.bbox(),
            motion,
            state: TrackState::Tracking,
            frame_size: (width, height),
            time_s: frame.time_s(),
        }
    }

    /// Gives a restored loop its name back and lets `check` rebuild and examine its parts.
    ///
    /// # Errors
    /// Whatever `check` finds wrong.
    pub fn revived(
        mut self,
        name: &'static str,
        check: impl FnOnce(&mut R, &mut L, &mut P, &mut M) -> Result<()>,
    ) -> Result<Self> {
        self.name = Name(name);
        check(&mut self.proposer, &mut self.localizer, &mut self.policy, &mut self.motion)?;
        Ok(self)
    }

    /// The localizer, to look inside.
    pub const fn localizer(&self) -> &L {
        &self.localizer
    }

    /// The motion filter, to look inside.
    pub const fn motion(&self) -> &M {
        &self.motion
    }

    fn step(&mut self, frame: &Frame) -> Result<Estimate> {
        let dt_s = self.advance_clock(frame)?;
        let failed = |source| TrackingError::Computation { tracker: self.name.0, index: frame.index(), source };

        let prior = self.motion.predict(dt_s).map_err(failed)?;
        let search = self.proposer.propose(frame, &prior, self.state);
        let found = self.localizer.locate(frame, &search)?;
        let evidence = Evidence { frame, prior: &prior, search: &search, found: found.as_ref(), state: self.state };
        let verdict = self.policy.judge(&evidence);
        let verdict = Self::within_reach(verdict, frame, &prior, found.as_ref());
        let believed = found.as_ref().filter(|_| verdict.state == TrackState::Tracking);
        if let Some(measurement) = believed {
            let elsewhere = !search.region.contains(measurement.bbox.center());
            if self.state == TrackState::Lost || elsewhere {
                // It came back anywhere: what was believed of its motion says nothing about where it is now.
                self.motion.restart(measurement.bbox);
            } else {
                self.motion.correct(measurement).map_err(failed)?;
            }
            if verdict.learn {
                self.localizer.adapt(frame, self.motion.bbox())?;
            }
            self.last_believed = self.motion.bbox();
        } else if let Some(guess) = found.as_ref().filter(|_| self.policy.follows(verdict.state)) {
            self.motion.correct(guess).map_err(failed)?;
        }
        self.state = verdict.state;
        Ok(Estimate {
            bbox: if verdict.state == TrackState::Lost { self.last_believed } else { self.motion.bbox() },
            score: verdict.score.clamp(0.0, 1.0),
            state: verdict.state,
            prediction: Some(prior.bbox),
            measurement: found.as_ref().map(|m| m.bbox),
            covariance: self.motion.covariance(),
            diagnostics: found.map(|m| m.diagnostics).unwrap_or_default(),
        })
    }

    /// What no policy may say: that a target outside of the picture was measured there, or that one coasted out of the
    /// picture's neighbourhood (long unseen, or after a gap in time) is merely occluded. Nobody can search for it there,
    /// and nobody should steer by it.
    fn within_reach(verdict: Verdict, frame: &Frame, prior: &Prior, found: Option<&Measurement>) -> Verdict {
        let Size { width, height } = frame.size();
        let outside = found.is_none_or(|f| f.bbox.clipped_to(frame.size()).is_none());
        let state = if verdict.state == TrackState::Tracking && outside { TrackState::Occluded } else { verdict.state };
        let reach = frame.size().bounds().expanded(width.max(height) as f64);
        let state = if state == TrackState::Occluded && !reach.contains(prior.bbox.center()) {
            TrackState::Lost
        } else {
            state
        };
        if state == verdict.state { verdict } else { Verdict { state, score: 0.0, learn: false } }
    }

    /// Seconds since the last frame, after checking that this one fits.
    fn advance_clock(&mut self, frame: &Frame) -> Result<f64> {
        let expected = Size::new(self.frame_size.0, self.frame_size.1);
        if frame.size() != expected {
            return Err(TrackingError::FrameSize { index: frame.index(), expected, actual: frame.size() });
        }
        let dt_s = frame.time_s() - self.time_s;
        let dt_s = if dt_s >= SHORTEST_STEP_S { dt_s } else { SHORTEST_STEP_S };
        if frame.time_s().is_finite() {
            self.time_s = frame.time_s();
        }
        Ok(dt_s)
    }
}

impl<R, L, P, M> Tracker for SingleTarget<R, L, P, M>
where
    R: Proposer + Clone + Serialize + DeserializeOwned + 'static,
    L: Localizer + Clone + Serialize + DeserializeOwned + 'static,
    P: Policy + Clone + Serialize + DeserializeOwned + 'static,
    M: MotionFilter + Clone + Serialize + DeserializeOwned + 'static,
{
    fn update(&mut self, frame: &Frame) -> Result<Estimate> {
        self.step(frame)
    }

    fn reinit(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        check_box(frame, bbox)?;
        self.localizer.restart(frame, bbox)?;
        self.motion.restart(bbox);
        self.policy.restart();
        self.state = TrackState::Tracking;
        self.last_believed = bbox;
        self.frame_size = (frame.size().width, frame.size().height);
        self.time_s = frame.time_s();
        Ok(())
    }

    fn save(&self) -> Result<Vec<u8>> {
        snapshot::write(self.name.0, self)
    }

    fn boxed_clone(&self) -> Box<dyn Tracker> {
        Box::new(self.clone())
    }
}
