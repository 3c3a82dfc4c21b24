use crate::motion::{CameraShift, Motion, MotionFilter, Sight};
use crate::policy::{Evidence, Policy, Verdict};
use crate::roles::{Localizer, Measurement, Outcome, Prior, Search, Weighed};
use crate::search::{Found, Proposer, Situation};
use crate::{Estimate, Forecast, GroupParams, Result, TrackState, Tracker, TrackingError, check_box, snapshot};
use pursuit_geometry::{BBox, Point, Size};
use pursuit_imaging::Frame;
use serde::{Deserialize, Serialize, de::DeserializeOwned};

/// Time that stands still or runs backwards (flaky cameras do that) counts as this many seconds.
const SHORTEST_STEP_S: f64 = 1e-3;

/// The one loop: predict → search → judge → correct or coast → learn.
///
/// Each clause has one owner: the proposer says where to look, the localizer `L` finds, the policy judges, the motion model
/// predicts and corrects, and appearance learns only when the policy says so.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct SingleTarget<L> {
    name: String,
    proposer: Proposer,
    localizer: L,
    policy: Policy,
    motion: Motion,
    camera: CameraShift,
    state: TrackState,
    last_believed: BBox,
    frame_size: (usize, usize),
    time_s: f64,
    #[serde(skip)]
    searches: Vec<Search>,
    #[serde(skip)]
    places: Vec<BBox>,
}

impl<L: Localizer> SingleTarget<L> {
    /// A loop that starts on `frame`: `localizer` knows the target at `bbox`, the groups say how the rest works.
    ///
    /// # Errors
    /// When the motion model cannot start from the box.
    pub fn new(name: &str, frame: &Frame, bbox: BBox, localizer: L, groups: &GroupParams) -> Result<Self> {
        let Size { width, height } = frame.size();
        let motion = Motion::new(groups.motion.clone(), bbox).map_err(failed(name, frame.index()))?;
        Ok(Self {
            name: name.to_owned(),
            proposer: Proposer::new(groups.search.clone(), &bbox),
            localizer,
            policy: Policy::new(groups.policy.clone()),
            motion,
            camera: camera_from(groups, frame, &bbox),
            state: TrackState::Tracking,
            last_believed: bbox,
            frame_size: (width, height),
            time_s: frame.time_s(),
            searches: Vec::new(),
            places: Vec::new(),
        })
    }

    /// The localizer, to look inside.
    pub const fn localizer(&self) -> &L {
        &self.localizer
    }

    /// The motion model, to look inside.
    pub const fn motion(&self) -> &Motion {
        &self.motion
    }

    fn step(&mut self, frame: &Frame) -> Result<Estimate> {
        let (index, dt_s) = (frame.index(), self.time_since_last(frame)?);
        if frame.time_s().is_finite() {
            self.time_s = frame.time_s();
        }
        self.compensate(frame);
        let prior = self.motion.predict(dt_s).map_err(failed(&self.name, index))?;
        let situation = self.situation(frame, &prior);
        let (found, searched) = self.look(frame, &situation)?;
        let evidence = Evidence { frame: frame.size(), prior: &prior, found: found.as_ref(), state: self.state };
        let verdict = within_reach(self.policy.judge(&evidence), frame.size(), &prior, found.as_ref());
        let doubt = evidence.doubt(verdict.state, || self.localizer.doubt(frame, &prior.bbox));
        if let Some(measurement) = &found {
            if verdict.state == TrackState::Tracking {
                self.believe(frame, measurement, &situation, verdict.learn)?;
            } else if verdict.follow {
                self.motion.correct(&measurement.into()).map_err(failed(&self.name, index))?;
                if verdict.learn {
                    self.localizer.adapt(frame, measurement.bbox, measurement)?;
                }
            }
        }
        self.state = verdict.state;
        let lost = verdict.state == TrackState::Lost;
        let bbox = if verdict.state == TrackState::Occluded { self.motion.bbox() } else { self.last_believed };
        let followed = match verdict.state {
            TrackState::Tracking => found.as_ref().map(|_| bbox),
            _ => found.as_ref().filter(|_| verdict.follow).map(|m| m.bbox),
        };
        let outcome = Outcome { state: self.state, bbox: self.motion.bbox(), found: found.as_ref(), followed, dt_s };
        self.localizer.observe(frame, &outcome)?;
        let measurement = found.as_ref().map(|m| m.bbox);
        Ok(Estimate {
            time_s: frame.time_s(),
            bbox,
            score: verdict.score.clamp(0.0, 1.0),
            state: verdict.state,
            doubt,
            prediction: Some(prior.bbox),
            measurement,
            searched,
            covariance: self.motion.covariance(),
            velocity: self.motion.velocity().filter(|_| !lost),
            next: self.motion.next_sample(),
            diagnostics: found.map(|m| m.diagnostics).unwrap_or_default(),
        })
    }

    /// Moves what is believed with the picture, where the camera's motion is compensated.
    fn compensate(&mut self, frame: &Frame) {
        if let Some((dx, dy)) = self.camera.at(frame, &self.motion.bbox()) {
            self.motion.carry((dx, dy));
            self.proposer.carry((dx, dy));
            self.last_believed = self.last_believed.translated(dx, dy);
        }
    }

    fn situation<'a>(&self, frame: &Frame, prior: &'a Prior) -> Situation<'a> {
        Situation {
            frame: frame.size(),
            prior,
            state: self.state,
            view: self.localizer.view(&prior.bbox),
            sure_from: self.policy.sure_from(),
        }
    }

    /// Looks where the proposer says, until it has seen enough, and measures what it decides on; and where it looked.
    fn look(&mut self, frame: &Frame, situation: &Situation<'_>) -> Result<(Option<Measurement>, Option<BBox>)> {
        let mut first = None;
        self.places.clear();
        self.localizer.suggest(frame, situation.prior, situation.state, &mut self.places)?;
        self.proposer.begin();
        loop {
            self.proposer.propose(situation, &self.places, &mut self.searches);
            if self.searches.is_empty() {
                break;
            }
            first = first.or_else(|| self.searches.first().map(|s| s.region));
            let mut best: Option<Found> = None;
            for search in &self.searches {
                if let Some(measurement) = self.localizer.locate(frame, search)?
                    && best.as_ref().is_none_or(|b| measurement.strength > b.measurement.strength)
                {
                    best = Some(Found { search: search.clone(), measurement });
                }
            }
            self.proposer.take(best);
        }
        let Some(found) = self.proposer.finish(situation) else { return Ok((None, first)) };
        let measurement = self.localizer.refine(frame, found.measurement, found.search.look)?;
        self.proposer.settle(&measurement.bbox);
        Ok((Some(measurement), Some(found.search.region)))
    }

    /// Corrects the motion by a measurement that is the target, and learns from it if `learn`.
    fn believe(&mut self, frame: &Frame, seen: &Measurement, situation: &Situation<'_>, learn: bool) -> Result<()> {
        let elsewhere = !self.proposer.neighbourhood(situation).contains(seen.bbox.center());
        if self.state == TrackState::Lost || elsewhere {
            // What was believed of its motion says nothing about where it is now.
            self.motion.restart(seen.bbox);
        } else {
            self.motion.correct(&Sight::from(seen)).map_err(failed(&self.name, frame.index()))?;
        }
        let filtered = self.motion.bbox();
        self.last_believed = match self.localizer.weigh(frame, seen, &filtered)? {
            Weighed::Filtered => filtered,
            Weighed::Measured => seen.bbox,
            Weighed::Restarted => {
                self.motion.restart(seen.bbox);
                seen.bbox
            }
        };
        if learn {
            self.localizer.adapt(frame, self.last_believed, seen)?;
            self.proposer.settle(&self.last_believed);
        }
        Ok(())
    }

    /// Seconds since the last frame, after checking that this one fits.
    fn time_since_last(&self, frame: &Frame) -> Result<f64> {
        let expected = Size::new(self.frame_size.0, self.frame_size.1);
        if frame.size() != expected {
            return Err(TrackingError::FrameSize { index: frame.index(), expected, actual: frame.size() });
        }
        let dt_s = frame.time_s() - self.time_s;
        Ok(if dt_s >= SHORTEST_STEP_S { dt_s } else { SHORTEST_STEP_S })
    }
}

/// The compensation of the camera's motion, having seen the frame that the target is started on.
fn camera_from(groups: &GroupParams, frame: &Frame, bbox: &BBox) -> CameraShift {
    let mut camera = CameraShift::new(groups.motion.camera);
    camera.at(frame, bbox);
    camera
}

/// What no policy may say: that a target outside of the picture was measured there, or that one coasted out of the
/// picture's neighbourhood (long unseen, or after a gap in time) is merely occluded. Nobody can search for it there, and
/// nobody should steer by it.
fn within_reach(verdict: Verdict, frame: Size, prior: &Prior, found: Option<&Measurement>) -> Verdict {
    let outside = found.is_none_or(|f| f.bbox.clipped_to(frame).is_none());
    let state = if verdict.state == TrackState::Tracking && outside { TrackState::Occluded } else { verdict.state };
    let reach = frame.bounds().expanded(frame.width.max(frame.height) as f64);
    let astray = state == TrackState::Occluded && !reach.contains(prior.bbox.center());
    let state = if astray { TrackState::Lost } else { state };
    if state == verdict.state { verdict } else { Verdict { state, score: 0.0, follow: false, learn: false } }
}

/// Says of an error of the motion model whose it is.
fn failed<E: std::error::Error + Send + Sync + 'static>(name: &str, index: u64) -> impl FnOnce(E) -> TrackingError {
    move |source| TrackingError::Computation { tracker: name.to_owned(), index, source: Box::new(source) }
}

impl<L: Localizer + Clone + Serialize + DeserializeOwned + 'static> Tracker for SingleTarget<L> {
    fn update(&mut self, frame: &Frame) -> Result<Estimate> {
        self.step(frame)
    }

    fn peek(&mut self, frame: &Frame) -> Result<Option<Measurement>> {
        let dt_s = self.time_since_last(frame)?;
        let (motion, proposer) = (self.motion.clone(), self.proposer.clone());
        let (camera, last_believed) = (self.camera.clone(), self.last_believed);
        self.compensate(frame);
        let looked = self.motion.predict(dt_s).map_err(failed(&self.name, frame.index())).and_then(|prior| {
            let situation = self.situation(frame, &prior);
            self.look(frame, &situation)
        });
        (self.motion, self.proposer) = (motion, proposer);
        (self.camera, self.last_believed) = (camera, last_believed);
        looked.map(|(measurement, _)| measurement)
    }

    fn forecast(&self, seconds: f64) -> Result<Forecast> {
        let forecast = self.motion.forecast(self.time_s, seconds).map_err(failed(&self.name, 0))?;
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

    fn reinit(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        check_box(frame, bbox)?;
        self.localizer.restart(frame, bbox)?;
        self.motion.restart(bbox);
        self.policy.restart();
        self.proposer.restart(&bbox);
        self.camera = CameraShift::new(self.motion.params().camera);
        self.camera.at(frame, &bbox);
        self.state = TrackState::Tracking;
        self.last_believed = bbox;
        self.frame_size = (frame.size().width, frame.size().height);
        self.time_s = frame.time_s();
        Ok(())
    }

    fn change(&mut self, changes: &toml::Table) -> Result<()> {
        let groups = GroupParams {
            motion: self.motion.params().clone(),
            policy: self.policy.params().clone(),
            search: self.proposer.params().clone(),
        };
        let changed = groups.with_changes(&self.name, changes)?;
        if changed.motion != groups.motion {
            self.camera = CameraShift::new(changed.motion.camera);
            self.motion.change(changed.motion).map_err(failed(&self.name, 0))?;
        }
        self.policy.change(changed.policy);
        self.proposer.change(changed.search);
        Ok(())
    }

    fn save(&self) -> Result<Vec<u8>> {
        snapshot::write(&self.name, self)
    }

    fn boxed_clone(&self) -> Box<dyn Tracker> {
        Box::new(self.clone())
    }
}
