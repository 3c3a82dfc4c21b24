//! By trial: whatever is detected is followed while a ratio test weighs it against clutter.

use super::super::hypothesis::Hypothesis;
use super::super::{
    AcquisitionParams, Clock, Elapsed, MultiTracker, RecipeOf, TargetId, TargetSet, Track, usable_detections,
};
use super::saved::Saved;
use crate::belief::LastFrame;
use crate::class::Classes;
use crate::{Detection, Detector, Followed, Forecast, Recipe, Result, TrackState, TrackingError, snapshot};
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_parameters::Parameters;
use rayon::prelude::*;
use std::sync::Arc;

/// The name that errors and saved states bear.
const NAME: &str = "acquiring";

/// One target that a detector finds, made sure of while it is followed already.
pub(super) struct Trials {
    params: AcquisitionParams,
    detector: Box<dyn Detector>,
    recipe: Box<dyn Recipe>,
    /// The confirmed target, and those that a user added.
    targets: TargetSet,
    /// The target sought; `None` once a user has removed it.
    sought: Option<TargetId>,
    /// What the target may be, the leader first.
    hypotheses: Vec<Hypothesis>,
    /// What the confirmed target was taken for.
    classes: Classes,
    /// How long the confirmed target has been lost, in seconds.
    lost_s: f64,
    last: Option<LastFrame>,
    clock: Arc<dyn Clock>,
}

impl Trials {
    /// Seeks what `detector` finds, to follow it by trackers of `recipe`.
    pub fn timed_by(
        clock: Arc<dyn Clock>,
        detector: Box<dyn Detector>,
        recipe: Box<dyn Recipe>,
        params: AcquisitionParams,
    ) -> Result<Self> {
        params.validate(NAME)?;
        let mut targets = TargetSet::timed_by(clock.clone());
        let sought = Some(targets.reserve());
        Ok(Self {
            params,
            detector,
            recipe,
            targets,
            sought,
            hypotheses: Vec::new(),
            classes: Classes::default(),
            lost_s: 0.0,
            last: None,
            clock,
        })
    }

    /// What the target may be while nothing is confirmed: boxes and their evidence in nats, the leader first.
    pub fn hypotheses(&self) -> impl Iterator<Item = (BBox, f64)> + '_ {
        self.hypotheses.iter().map(|h| (h.bbox, h.evidence.nats.0))
    }

    /// Whether the target is confirmed.
    pub fn is_confirmed(&self) -> bool {
        self.sought.is_some_and(|id| self.targets.contains(id))
    }

    /// As [`save`](MultiTracker::save) left it, with `detector` in place of the one it had: what a detector has learned is
    /// not saved. `recipe_of` knows the recipes of trackers by name.
    ///
    /// # Errors
    /// Bytes that another version or nobody wrote, or a tracker that `recipe_of` does not know.
    pub fn restore(
        clock: Arc<dyn Clock>,
        saved: &[u8],
        detector: Box<dyn Detector>,
        recipe_of: RecipeOf<'_>,
    ) -> Result<Self> {
        let saved: Saved = snapshot::read(NAME, saved)?;
        let problem = |problem: String| TrackingError::Snapshot { tracker: NAME.to_owned(), problem };
        let parameters = saved.recipe.1.parse().map_err(|e: toml::de::Error| problem(e.to_string()))?;
        let recipe = recipe_of(&saved.recipe.0)?.with(&parameters)?;
        let mut hypotheses = Vec::new();
        for (evidence, classes, bbox, tracker) in saved.hypotheses {
            let tracker = recipe_of(snapshot::owner(&tracker)?)?.restore(&tracker)?;
            hypotheses.push(Hypothesis { tracker, evidence, classes, bbox, answer: None });
        }
        let mut restored = Self::timed_by(clock, detector, recipe, saved.params)?;
        restored.targets = TargetSet::restore(&saved.targets, recipe_of)?;
        (restored.sought, restored.hypotheses, restored.classes) = (saved.sought, hypotheses, saved.classes);
        (restored.lost_s, restored.last) = (saved.lost_s, saved.last);
        Ok(restored)
    }

    /// Goes on with every hypothesis, asks the detector, and weighs.
    fn weigh(&mut self, frame: &Frame, dt_s: f64, tracked: &[Followed]) -> Result<()> {
        let (params, clock) = (&self.params, &*self.clock);
        let one = |hypothesis: &mut Hypothesis| {
            let (updated, elapsed) = Elapsed::of(clock, || hypothesis.update(frame, dt_s, params));
            if let Some(answer) = &mut hypothesis.answer {
                answer.elapsed = elapsed;
            }
            updated
        };
        match self.hypotheses.as_mut_slice() {
            [hypothesis] => one(hypothesis)?,
            hypotheses => hypotheses.par_iter_mut().with_max_len(1).try_for_each(one)?,
        }
        let believed = self.hypotheses.iter().map(|h| Followed { bbox: h.bbox, measured: true });
        let followed: Vec<Followed> = believed.chain(tracked.iter().copied()).collect();
        let mut detections = usable_detections(&mut *self.detector, frame, &followed)?;
        detections.retain(|d| !self.classes.is_other(d.class.as_ref()));
        let claimed = self.claim(&detections);
        self.start_further(frame, &detections, &claimed)?;
        self.rank();
        Ok(())
    }

    /// Gives every detection to the hypothesis that overlaps it most, the stronger hypothesis first; returns which
    /// detections were taken.
    fn claim(&mut self, detections: &[Detection]) -> Vec<bool> {
        let mut claimed = vec![false; detections.len()];
        for hypothesis in &mut self.hypotheses {
            let overlap = |i: usize| detections[i].bbox.iou(&hypothesis.bbox);
            let free = (0..detections.len()).filter(|i| !claimed[*i] && overlap(*i) >= self.params.overlap);
            // Of equals the detector's better one, which comes first.
            let best = free.reduce(|a, b| if overlap(b) > overlap(a) { b } else { a });
            hypothesis.look(best.and_then(|i| detections.get(i)), &self.params);
            if let Some(i) = best {
                claimed[i] = true;
            }
        }
        claimed
    }

    /// Starts hypotheses on detections that nobody claims, the detector's best first.
    fn start_further(&mut self, frame: &Frame, detections: &[Detection], claimed: &[bool]) -> Result<()> {
        for (detection, _) in
            detections.iter().zip(claimed).filter(|(d, claimed)| !**claimed && d.confidence >= self.params.start_from)
        {
            let known = |h: &Hypothesis| h.bbox.iou(&detection.bbox) >= self.params.overlap;
            if self.hypotheses.len() < self.params.most_hypotheses && !self.hypotheses.iter().any(known) {
                let clock = &*self.clock;
                let start = || Hypothesis::start(&*self.recipe, frame, detection, &self.params);
                let (hypothesis, elapsed) = Elapsed::of(clock, start);
                let mut hypothesis = hypothesis?;
                if let Some(answer) = &mut hypothesis.answer {
                    answer.elapsed = elapsed;
                }
                self.hypotheses.push(hypothesis);
            }
        }
        Ok(())
    }

    /// Drops what is refuted or lost, and puts a rival first that is clearly stronger than the leader. The leader itself is
    /// kept while there is nothing better, unless its tracker has lost it.
    fn rank(&mut self) {
        let params = &self.params;
        let mut place = 0;
        self.hypotheses.retain(|h| {
            let leads = place == 0;
            place += 1;
            !h.is_lost() && (leads || !h.evidence.is_refuted(params))
        });
        let nats = |h: &Hypothesis| h.evidence.nats.0;
        let Some(leader) = self.hypotheses.first().map(nats) else { return };
        let strongest = (1..self.hypotheses.len())
            .reduce(|a, b| if nats(&self.hypotheses[b]) > nats(&self.hypotheses[a]) { b } else { a });
        if let Some(strongest) = strongest.filter(|i| nats(&self.hypotheses[*i]) > leader + params.lead) {
            self.hypotheses[..=strongest].rotate_right(1);
        }
    }

    /// Whether the leader is taken for the target; `again`: of one that was lost more is asked.
    fn is_sure(&self, again: bool) -> bool {
        self.hypotheses.first().is_some_and(|leader| {
            let evidence = &leader.evidence;
            let undisputed = evidence.age_s >= self.params.trial_s && !evidence.is_refuted(&self.params);
            evidence.is_confirmed(&self.params) || (undisputed && !again)
        })
    }

    /// Adds what the detector says of the frame as a whole to every target's figures.
    fn say(&self, tracks: &mut [Track]) {
        let figures = self.detector.diagnostics();
        tracks.iter_mut().filter_map(|t| t.estimate.as_mut()).for_each(|e| e.diagnostics.extend(figures.figures()));
    }

    /// Seeks the target, and says what is known of it.
    fn seek(
        &mut self,
        id: TargetId,
        frame: &Frame,
        dt_s: f64,
        tracked: &[Followed],
        again: bool,
    ) -> Result<Option<Track>> {
        let (weighed, elapsed) = {
            let clock = self.clock.clone();
            Elapsed::of(&*clock, || self.weigh(frame, dt_s, tracked))
        };
        weighed?;
        let sure = self.is_sure(again);
        let leader = self.hypotheses.first_mut();
        let (class, answer) = leader.map_or((None, None), |h| (h.classes.most_likely().cloned(), h.answer.take()));
        if sure {
            let leader = self.hypotheses.swap_remove(0);
            self.targets.put(id, leader.tracker);
            self.classes = leader.classes;
            self.hypotheses.clear();
            self.lost_s = 0.0;
        } else if again {
            return Ok(None);
        }
        Ok(Some(match answer {
            Some(a) => {
                Track { id, estimate: Some(a.estimate), started: a.started, elapsed: a.elapsed, class, detection: None }
            }
            None => Track { id, estimate: None, started: false, elapsed, class, detection: None },
        }))
    }
}

/// What a detector is told of `tracks`.
fn followed(tracks: &[Track]) -> Vec<Followed> {
    let seen = tracks.iter().filter_map(|t| t.estimate.as_ref()).filter(|e| e.state != TrackState::Lost);
    seen.map(|e| Followed { bbox: e.bbox, measured: e.state == TrackState::Tracking }).collect()
}

impl MultiTracker for Trials {
    fn step(&mut self, frame: &Frame, tracks: &mut Vec<Track>) -> Result<()> {
        let dt_s = LastFrame::start_or_advance(&mut self.last, frame)?;
        self.targets.step(frame, tracks)?;
        let Some(id) = self.sought else { return Ok(()) };
        let at = tracks.iter().position(|t| t.id == id);
        if let Some(at) = at {
            tracks[at].class = self.classes.most_likely().cloned();
        }
        let lost = at.and_then(|at| tracks[at].estimate.as_ref()).is_some_and(|e| e.state == TrackState::Lost);
        self.lost_s = if lost { self.lost_s + dt_s } else { 0.0 };
        if at.is_some() && self.lost_s <= self.params.seek_again_after_s {
            self.hypotheses.clear();
            self.say(tracks);
            return Ok(());
        }
        let tracked = followed(tracks);
        match (self.seek(id, frame, dt_s, &tracked, at.is_some())?, at) {
            (Some(track), Some(at)) => tracks[at] = track,
            (Some(track), None) => {
                let at = tracks.partition_point(|t| t.id < id);
                tracks.insert(at, track);
            }
            (None, _) => {}
        }
        self.say(tracks);
        Ok(())
    }

    fn add(&mut self, recipe: &dyn Recipe, frame: &Frame, bbox: BBox) -> Result<TargetId> {
        self.targets.add(recipe, frame, bbox)
    }

    fn remove(&mut self, id: TargetId) -> Result<()> {
        if self.sought != Some(id) {
            return self.targets.remove(id);
        }
        self.sought = None;
        self.hypotheses.clear();
        if self.targets.contains(id) { self.targets.remove(id) } else { Ok(()) }
    }

    fn reinit(&mut self, id: TargetId, frame: &Frame, bbox: BBox) -> Result<()> {
        if self.sought != Some(id) {
            return self.targets.reinit(id, frame, bbox);
        }
        if self.targets.contains(id) {
            self.targets.reinit(id, frame, bbox)?;
            self.classes = Classes::default();
            return Ok(());
        }
        self.targets.put(id, self.recipe.init(frame, bbox)?);
        self.hypotheses.clear();
        Ok(())
    }

    fn change(&mut self, id: Option<TargetId>, changes: &toml::Table) -> Result<()> {
        // Trackers started later are to have the changes too.
        let recipe = self.recipe.with(changes)?;
        let mut trackers = Vec::new();
        for hypothesis in self.hypotheses.iter().filter(|_| id.is_none() || id == self.sought) {
            let mut tracker = hypothesis.tracker.boxed_clone();
            tracker.change(changes)?;
            trackers.push(tracker);
        }
        if id.is_none() || id.is_some_and(|id| self.sought != Some(id) || self.targets.contains(id)) {
            self.targets.change(id, changes)?;
        }
        if id.is_none() || id == self.sought {
            self.recipe = recipe;
        }
        for (hypothesis, tracker) in self.hypotheses.iter_mut().zip(trackers) {
            hypothesis.tracker = tracker;
        }
        Ok(())
    }

    fn forecast(&self, id: TargetId, seconds: f64) -> Result<Forecast> {
        match self.hypotheses.first() {
            Some(leader) if self.sought == Some(id) && !self.targets.contains(id) => leader.tracker.forecast(seconds),
            _ => self.targets.forecast(id, seconds),
        }
    }

    fn ids(&self) -> Vec<TargetId> {
        let mut ids = self.targets.ids();
        ids.extend(self.sought.filter(|id| !self.targets.contains(*id)));
        ids.sort_unstable();
        ids
    }

    fn save(&self) -> Result<Vec<u8>> {
        let saved = |h: &Hypothesis| Ok((h.evidence, h.classes.clone(), h.bbox, h.tracker.save()?));
        let hypotheses = self.hypotheses.iter().map(saved).collect::<Result<_>>()?;
        let raw = Saved {
            params: self.params.clone(),
            recipe: (self.recipe.name().to_owned(), self.recipe.parameters()?.to_string()),
            targets: self.targets.save()?,
            sought: self.sought,
            hypotheses,
            classes: self.classes.clone(),
            lost_s: self.lost_s,
            last: self.last,
        };
        snapshot::write(NAME, &raw)
    }
}
