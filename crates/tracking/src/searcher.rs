//! What looks for one target: where to look, what is seen there, and what is learned of it.

use crate::belief::{Belief, failed};
use crate::motion::{MotionFilter, Sight};
use crate::policy::Verdict;
use crate::search::{Observation, Progress, Proposer, SearchParams, Situation};
use crate::{Estimate, Localizer, Measurement, Outcome, Prior, Result, Search, TrackState, Weighed, snapshot};
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Looks for one target around a belief that is its caller's: the part of a tracker that knows looks.
pub trait Appearance: Send {
    /// Looks for the target in `frame`, where `prior` was predicted, and makes of it what `belief` judges. `told` is what
    /// somebody else measured of the target: that is then the measurement, and what is seen is learned where it agrees, or
    /// learning starts anew. Without, what is seen is the measurement where `believable` says so of it.
    ///
    /// # Errors
    /// A frame of another size or kind than the first. Losing the target is no error.
    fn follow(
        &mut self,
        frame: &Frame,
        belief: &mut Belief,
        prior: &Prior,
        told: Option<&Told<'_>>,
        believable: &dyn Fn(&Measurement) -> bool,
    ) -> Result<Estimate>;

    /// Forgets everything and starts on the target inside `bbox`.
    ///
    /// # Errors
    /// When the frame or the box cannot be used.
    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()>;

    /// The camera's motion moved the picture by `(dx, dy)` pixels.
    fn carry(&mut self, shift: (f64, f64));

    /// Everything needed to go on later, for [`Recipe::restore_appearance`](crate::Recipe::restore_appearance).
    ///
    /// # Errors
    /// When the state cannot be written down.
    fn save(&self) -> Result<Vec<u8>>;
}

/// What somebody else measured of a target.
#[derive(Debug, Clone, Copy)]
pub struct Told<'a> {
    /// The box and its probability.
    pub measurement: &'a Measurement,
    /// The measurements that it stands for, each with the probability that it is the target's; empty: itself, for certain.
    pub shared: &'a [(Sight, f64)],
    /// What is seen at a lesser overlap (IoU) is something else.
    pub least_overlap: f64,
}

/// A proposer and a localizer: where to look for one target, and what is seen there.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Searcher<L> {
    pub name: String,
    pub proposer: Proposer,
    pub localizer: L,
    #[serde(skip)]
    searches: Vec<Search>,
    #[serde(skip)]
    places: Vec<BBox>,
}

/// What was decided on in a frame, if anything was found.
type Looked<L> = Option<Observation<<L as Localizer>::Finding>>;

impl<L: Localizer> Searcher<L> {
    /// Of a localizer that knows the target at `bbox`.
    pub fn new(name: &str, search: SearchParams, localizer: L, bbox: &BBox) -> Self {
        let proposer = Proposer::new(search, bbox);
        Self { name: name.to_owned(), proposer, localizer, searches: Vec::new(), places: Vec::new() }
    }

    /// What the proposer goes by.
    pub fn situation<'a>(&self, frame: &Frame, belief: &Belief, prior: &'a Prior) -> Situation<'a> {
        Situation {
            frame: frame.size(),
            prior,
            state: belief.state,
            view: self.localizer.view(&prior.bbox),
            sure_from: belief.policy.sure_from(),
            elsewhere: belief.policy.looks_elsewhere(),
        }
    }

    /// Looks where the proposer says, until it has seen enough, and measures what it decides on; and where it looked.
    pub fn look(&mut self, frame: &Frame, situation: &Situation<'_>) -> Result<(Looked<L>, Option<BBox>)> {
        let (mut first, mut progress) = (None, Progress::default());
        self.places.clear();
        self.localizer.suggest(frame, situation.prior, situation.state, &mut self.places)?;
        loop {
            self.proposer.propose(situation, &self.places, &mut progress, &mut self.searches);
            if self.searches.is_empty() {
                break;
            }
            first = first.or_else(|| self.searches.first().map(|s| s.region));
            let mut best: Looked<L> = None;
            for search in &self.searches {
                if let Some((measurement, finding)) = self.localizer.locate(frame, search)?
                    && !self.proposer.refuses(situation, &measurement.bbox)
                    && best.as_ref().is_none_or(|b| measurement.strength > b.measurement.strength)
                {
                    best = Some(Observation { search: search.clone(), measurement, finding });
                }
            }
            progress.take(best);
        }
        let Some(mut found) = self.proposer.finish(situation, progress) else { return Ok((None, first)) };
        self.localizer.refine(frame, &found.search, &mut found.measurement, &mut found.finding)?;
        self.proposer.settle(&found.measurement.bbox);
        let region = found.search.region;
        Ok((Some(found), Some(region)))
    }

    /// Looks, has `belief` judge, corrects it and learns, as [`Appearance::follow`] says.
    pub fn step(
        &mut self,
        frame: &Frame,
        belief: &mut Belief,
        prior: &Prior,
        told: Option<&Told<'_>>,
        believable: &dyn Fn(&Measurement) -> bool,
    ) -> Result<Estimate> {
        let situation = self.situation(frame, belief, prior);
        let (found, searched) = self.look(frame, &situation)?;
        let own = |seen: &Measurement| match told {
            Some(told) => seen.bbox.iou(&told.measurement.bbox) >= told.least_overlap,
            None => believable(seen),
        };
        let found = found.filter(|f| own(&f.measurement));
        let (seen, finding) = (found.as_ref().map(|f| &f.measurement), found.as_ref().map(|f| &f.finding));
        let measurement = told.map(|t| t.measurement).or(seen);
        let hidden = || self.localizer.doubt(frame, &prior.bbox, finding);
        let on_probation = belief.policy.is_on_probation();
        let judgement = belief.judge(frame.size(), prior, measurement, told.is_none(), hidden);
        let verdict = judgement.0;
        match (told, &found) {
            (Some(told), _) => self.take(frame, belief, told, found.as_ref(), verdict)?,
            (None, Some(found)) => self.believe(frame, belief, found, &situation, verdict)?,
            (None, None) => {}
        }
        match verdict.state {
            TrackState::Tracking => self.proposer.sure(&belief.last_believed, frame.size()),
            // What is not likely enough to be followed is no place to go on looking from.
            TrackState::Occluded if !verdict.follow && belief.policy.coasts() => {
                self.proposer.settle(&belief.motion.bbox());
            }
            TrackState::Lost if on_probation => self.proposer.refuse(&belief.last_believed),
            TrackState::Unsure | TrackState::Occluded | TrackState::Lost => {}
        }
        let mut estimate = belief.report(frame, prior, judgement, measurement);
        let followed = match verdict.state {
            TrackState::Tracking => measurement.map(|_| estimate.bbox),
            TrackState::Unsure | TrackState::Occluded | TrackState::Lost => {
                measurement.map(|m| m.bbox).filter(|_| verdict.follow)
            }
        };
        let seen = seen.map(|m| m.bbox).zip(finding);
        let outcome =
            Outcome { state: verdict.state, bbox: belief.motion.bbox(), found: seen, followed, dt_s: prior.dt_s };
        self.localizer.observe(frame, &outcome)?;
        estimate.searched = searched;
        // What is hidden or gone has no pixels.
        if matches!(verdict.state, TrackState::Tracking | TrackState::Unsure) {
            estimate.mask = finding.and_then(|f| self.localizer.mask(frame, f)).filter(|m| !m.is_empty()).map(Arc::new);
        }
        estimate.diagnostics = found.map(|f| f.measurement.diagnostics).unwrap_or_default();
        Ok(estimate)
    }

    /// Corrects the belief by what was seen and judged, and learns from it where the verdict says so.
    fn believe(
        &mut self,
        frame: &Frame,
        belief: &mut Belief,
        found: &Observation<L::Finding>,
        situation: &Situation<'_>,
        verdict: Verdict,
    ) -> Result<()> {
        let failed = |e| failed(&self.name, frame.index(), e);
        let seen = &found.measurement;
        if verdict.state == TrackState::Tracking {
            let elsewhere = !self.proposer.neighbourhood(situation).contains(seen.bbox.center());
            belief.believe(seen, &[], elsewhere).map_err(failed)?;
            match self.localizer.weigh(frame, &found.finding, &belief.last_believed)? {
                Weighed::Filtered => {}
                Weighed::Measured => belief.last_believed = seen.bbox,
                Weighed::Restarted => {
                    belief.motion.restart(seen.bbox);
                    belief.last_believed = seen.bbox;
                }
            }
            if verdict.learn {
                self.localizer.adapt(frame, belief.last_believed, &found.finding)?;
                self.proposer.settle(&belief.last_believed);
            }
        } else if verdict.follow {
            belief.motion.correct(&Sight::from(seen)).map_err(failed)?;
            if verdict.learn {
                self.localizer.adapt(frame, seen.bbox, &found.finding)?;
            }
        }
        Ok(())
    }

    /// Corrects the belief by what somebody else measured, and learns what was seen there.
    fn take(
        &mut self,
        frame: &Frame,
        belief: &mut Belief,
        told: &Told<'_>,
        found: Option<&Observation<L::Finding>>,
        verdict: Verdict,
    ) -> Result<()> {
        if verdict.state != TrackState::Tracking {
            return Ok(());
        }
        belief.believe(told.measurement, told.shared, false).map_err(|e| failed(&self.name, frame.index(), e))?;
        let Some(found) = found else { return self.restart_on(frame, told.measurement.bbox) };
        if verdict.learn {
            self.localizer.adapt(frame, belief.last_believed, &found.finding)?;
        }
        self.proposer.settle(&belief.last_believed);
        Ok(())
    }

    /// Forgets everything and starts on the target inside `bbox`.
    pub fn restart_on(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        self.localizer.restart(frame, bbox)?;
        self.proposer.restart(&bbox);
        Ok(())
    }
}

impl<L: Localizer + Serialize> Appearance for Searcher<L> {
    fn follow(
        &mut self,
        frame: &Frame,
        belief: &mut Belief,
        prior: &Prior,
        told: Option<&Told<'_>>,
        believable: &dyn Fn(&Measurement) -> bool,
    ) -> Result<Estimate> {
        self.step(frame, belief, prior, told, believable)
    }

    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        self.restart_on(frame, bbox)
    }

    fn carry(&mut self, shift: (f64, f64)) {
        self.proposer.carry(shift);
    }

    fn save(&self) -> Result<Vec<u8>> {
        snapshot::write(&self.name, self)
    }
}
