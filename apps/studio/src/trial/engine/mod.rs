//! The thread of a trial: obeys orders, follows, shows.

mod editing;
mod history;
mod keeping;
mod recorded;
mod returning;
mod seeking;
mod telling;

use super::handle::{Answer, Message, Order, Progress, Setup};
use super::looks::Looks;
use super::phase::Phase;
use super::proposer::Proposer;
use super::screen::{PICTURE_EVERY, Screen};
use crate::error::Refusal;
use crate::root::Root;
use history::History;
use keeping::Keeping;
pub(crate) use keeping::Place;
use pursuit::parameters::nested;
use pursuit::revise::{EditKind, EditedSession, Frames, Identity, Input, Label, Trajectory};
use pursuit::trackers::registry;
use pursuit::tracking::TrackerEntry;
use pursuit::{Frame, Remote, RunError};
use recorded::Recorded;
use returning::Return;
use serde_json::Value;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

/// How long it waits before it looks again how far another trial is.
const WAIT: Duration = Duration::from_millis(2);

pub(super) struct Engine {
    tracker: &'static TrackerEntry,
    /// Below which files lie that parameters name.
    root: Root,
    follower: EditedSession,
    pictures: Frames,
    trajectory: Trajectory,
    screen: Arc<Screen>,
    phase: Phase,
    message: Option<String>,
    /// The frame that is shown; what is followed may be ahead of it.
    shown: Arc<Frame>,
    speed: Option<f64>,
    /// When the next frame is due, at the pace wanted.
    due: Instant,
    /// When viewers were last shown something.
    shown_at: Instant,
    last_target: u64,
    step_ms: f64,
    /// The frame to stop at, which has not been followed yet, and who asked for it.
    goal: Option<(u64, Answer)>,
    /// The way back from a corrected frame that is gone now, and how the last one ended.
    returning: Option<Return>,
    returned: Option<Value>,
    /// What shows boxes to begin from.
    proposer: Option<Proposer>,
    /// How frames are looked at.
    looks: Looks,
    /// Of a trajectory that is known and was not followed here, or not again since it was undone.
    recorded: Option<Recorded>,
    /// What can be undone.
    history: History,
    /// What targets are called.
    labels: BTreeMap<u64, Label>,
    /// Where all of it is kept.
    keeping: Option<Keeping>,
    /// Whether anything was changed since the trial was opened.
    touched: bool,
    /// How far it is, for a trial that waits for this one.
    progress: Arc<Progress>,
    /// The trial that this one waits for, so that both can be looked at in the same frame.
    beside: Option<Arc<Progress>>,
}

impl Engine {
    pub fn open(setup: Setup, screen: Arc<Screen>, progress: Arc<Progress>) -> Result<Self, Refusal> {
        let Setup { locator, options, root, tracker, parameters, seeking, known, bench: _, place, called } = setup;
        let keeping = place.map(|place| Keeping::new(place, locator.clone(), called));
        let input = Input::new(locator, options);
        let tracker = registry::tracker(&tracker).map_err(RunError::from)?;
        let mut parameters = nested(&parameters);
        root.hold(&tracker.default_recipe().schema(), &mut parameters)?;
        let recipe = tracker.recipe(&parameters).map_err(RunError::from)?;
        let mut follower = EditedSession::new(input.clone(), recipe, seeking.clone(), Vec::new())?;
        let mut pictures = Frames::new(input, follower.info().live);
        let mut trajectory = Trajectory::default();
        let Some((shown, row)) = follower.step()? else { return Err(Refusal::unfit("this source has no frames")) };
        pictures.keep(&shown);
        trajectory.push(row);
        let speed = if follower.info().live { None } else { Some(1.0) };
        let mut engine = Self {
            tracker,
            root,
            follower,
            pictures,
            trajectory,
            screen,
            phase: Phase::Ready,
            message: None,
            shown,
            speed,
            due: Instant::now(),
            shown_at: Instant::now(),
            last_target: u64::from(seeking.is_some()),
            step_ms: 0.0,
            goal: None,
            returning: None,
            returned: None,
            proposer: seeking.map(Proposer::new).transpose()?,
            looks: Looks::default(),
            recorded: None,
            history: History::default(),
            labels: BTreeMap::new(),
            keeping,
            touched: false,
            progress,
            beside: None,
        };
        if let Some(known) = known {
            engine.take_over(known)?;
        }
        engine.show();
        Ok(engine)
    }

    /// Stops the input where it waits for a frame that may never come.
    pub fn remote(&self) -> Remote {
        self.follower.remote()
    }

    /// Until it is told to quit, or nobody can tell it anything; what is known then is kept.
    pub fn run(mut self, inbox: &Receiver<Message>) {
        self.obey_all(inbox);
        self.keep_at_last();
        self.progress.end();
    }

    fn obey_all(&mut self, inbox: &Receiver<Message>) {
        loop {
            self.share();
            let message = if self.phase == Phase::Running {
                match inbox.recv_timeout(self.due.saturating_duration_since(Instant::now())) {
                    Err(RecvTimeoutError::Timeout) => None,
                    Ok(message) => Some(message),
                    Err(RecvTimeoutError::Disconnected) => return,
                }
            } else {
                let Ok(message) = inbox.recv() else { return };
                Some(message)
            };
            match message {
                Some(Message::Quit) => return,
                Some(Message::Obey(order, answer)) => self.answer(order, answer),
                Some(Message::Version(number, answer)) => drop(answer.send(self.version(number))),
                Some(Message::Picture(frame, answer)) => drop(answer.send(self.picture(frame))),
                Some(Message::Shown(answer)) => drop(answer.send(Ok(self.shown.clone()))),
                // Both are to be looked at in the same frame: the other one goes first.
                None if self.is_ahead() => self.due = Instant::now() + WAIT,
                None => {
                    self.go_on();
                    self.keep();
                    // Nobody sees more pictures than a screen shows; the last one is always shown.
                    if self.phase != Phase::Running || self.shown_at.elapsed() >= PICTURE_EVERY {
                        self.show();
                    }
                }
            }
        }
    }

    /// Lets a trial that waits for this one know how far it is.
    fn share(&self) {
        self.progress.tell(&self.trajectory, self.phase == Phase::Running, self.step_ms);
    }

    /// Whether the trial that this one waits for has yet to follow the frame that comes next.
    fn is_ahead(&self) -> bool {
        self.returning.is_none() && self.beside.as_ref().is_some_and(|other| other.is_behind(self.shown.index() + 1))
    }

    /// Obeys, and says where the trial is then: of a frame that has not been followed yet, once it has.
    fn answer(&mut self, order: Order, answer: Answer) {
        if !matches!(order, Order::Tell | Order::Speed(_) | Order::Detect(_) | Order::Look(_) | Order::Beside(_)) {
            self.give_up_goal();
            if !(matches!(order, Order::Start) && self.start_after_return()) {
                self.break_off_return();
            }
        }
        let beyond = match order {
            Order::Seek(frame) => Some(frame),
            // What was recorded is followed first.
            Order::Step if self.recorded.is_some() && self.at_head() => Some(self.shown.index() + 1),
            _ => None,
        };
        let beyond = beyond.filter(|frame| self.is_beyond(*frame));
        let outcome = self.obey_and_remember(order);
        self.keep();
        self.share();
        self.show();
        match (outcome, beyond) {
            (Ok(()), Some(frame)) => {
                self.goal = Some((frame, answer));
                (self.phase, self.due) = (Phase::Running, Instant::now());
            }
            (outcome, _) => drop(answer.send(outcome.map(|()| self.facts()))),
        }
    }

    /// Whether this frame will be followed when the run goes on.
    fn is_beyond(&self, frame: u64) -> bool {
        let info = self.follower.info();
        let there = !info.live && info.frame_count.is_none_or(|n| frame < n);
        let over = matches!(self.phase, Phase::Ended | Phase::Failed);
        there && !over && self.trajectory.last().is_some_and(|r| r.frame < frame)
    }

    /// Stays where it is in place of going on to the frame that was asked for.
    fn give_up_goal(&mut self) {
        if let Some((_, answer)) = self.goal.take() {
            if self.phase == Phase::Running {
                self.phase = Phase::Paused;
            }
            // What stands still has boxes of the detector, which belong to the answer.
            self.keep();
            self.share();
            self.show();
            drop(answer.send(Ok(self.facts())));
        }
    }

    /// What changes the trial can be undone; what a live source has shown does not come again.
    fn obey_and_remember(&mut self, order: Order) -> Result<(), Refusal> {
        let what = match &order {
            Order::Add(_) => "a target",
            Order::Correct(..) => "a box",
            Order::Remove(_) => "a target removed",
            Order::Change(_) => "a parameter",
            Order::Tracker(..) => "another tracker",
            Order::Import(_) => "a file read",
            Order::Label(..) => "a name or a colour",
            Order::Merge(..) => "two targets merged",
            Order::Split(_) => "a target split",
            Order::Swap(..) => "two targets swapped",
            // Without a box it begins by itself.
            Order::Start => "the start",
            _ => return self.obey(order),
        };
        let before = self.moment(what);
        self.obey(order)?;
        if !self.follower.info().live && before.differs(self) {
            self.touched = true;
            self.history.push(before);
        }
        Ok(())
    }

    fn obey(&mut self, order: Order) -> Result<(), Refusal> {
        match order {
            Order::Start => self.start()?,
            Order::Pause => {
                if self.phase == Phase::Running {
                    self.phase = Phase::Paused;
                }
            }
            Order::Step => {
                self.pause();
                self.go_on();
            }
            Order::Back => {
                let before = self.trajectory.before(self.shown.index()).map(|r| r.frame);
                let before = before.ok_or_else(|| Refusal::conflict("this is the first frame"))?;
                self.pause();
                self.look_at(before)?;
            }
            Order::Stop => {
                if self.phase != Phase::Failed {
                    self.phase = Phase::Stopped;
                }
            }
            Order::Seek(frame) => self.seek(frame)?,
            Order::Speed(speed) => self.speed = speed.filter(|_| !self.follower.info().live),
            Order::Add(bbox) => self.add(bbox)?,
            Order::Correct(target, bbox, backward) => self.correct(target, bbox, backward)?,
            Order::Remove(target) => self.edit(EditKind::Remove { target }, &format!("target {target} removed"))?,
            Order::Change(parameters) => self.change(&parameters)?,
            Order::Tracker(name, parameters) => {
                let tracker = registry::tracker(&name).map_err(RunError::from)?;
                let mut parameters = nested(&parameters);
                self.root.hold(&tracker.default_recipe().schema(), &mut parameters)?;
                self.follow_anew(tracker, parameters, "another tracker")?;
            }
            Order::Detect(seeking) => self.proposer = seeking.map(Proposer::new).transpose()?,
            Order::Look(look) => self.look(look)?,
            Order::Undo => {
                self.pause();
                self.undo()?;
                self.touched = true;
            }
            Order::Redo => {
                self.pause();
                self.redo()?;
                self.touched = true;
            }
            Order::Import(text) => self.import(&text)?,
            Order::Label(target, label) => self.label(target, label)?,
            Order::Merge(target, into) => self.identify(&Identity::Merge { target, into })?,
            Order::Split(target) => {
                let (at, new) = (self.shown.index(), self.last_target + 1);
                self.identify(&Identity::Split { target, at, new })?;
            }
            Order::Swap(targets, frames) => self.identify(&Identity::Swap { targets, frames })?,
            Order::Beside(other) => self.beside = other,
            Order::Tell => {}
        }
        Ok(())
    }

    fn pause(&mut self) {
        if matches!(self.phase, Phase::Running | Phase::Ready | Phase::Stopped) {
            self.phase = Phase::Paused;
        }
    }

    fn start(&mut self) -> Result<(), Refusal> {
        if self.phase == Phase::Running {
            return Ok(());
        }
        // As the command line: without a box, the truth's where there is one.
        let is_idle = |engine: &Self| {
            let follower = &engine.follower;
            engine.recorded.is_none() && follower.edits().is_empty() && follower.seeking().is_none()
        };
        let idle = is_idle(self);
        if idle && let Some(proposer) = &self.proposer {
            self.seek_target(proposer.seeking.clone())?;
        } else if idle && let Some(bbox) = self.follower.info().truth_at(self.shown.index()).bbox() {
            self.add(bbox)?;
        }
        if is_idle(self) {
            return Err(Refusal::conflict(
                "nothing to follow yet; drag a box around the target in the picture, or choose a detector",
            ));
        }
        // What has come to its end begins anew, with everything that was done.
        if matches!(self.phase, Phase::Ended | Phase::Stopped | Phase::Failed) && self.at_head() {
            if self.follower.info().live {
                return Err(Refusal::conflict("a live source does not come again; open it once more"));
            }
            let parameters = self.follower.recipe().parameters().map_err(RunError::from)?;
            self.follow_anew(self.tracker, parameters, "started again")?;
        }
        (self.phase, self.due, self.message) = (Phase::Running, Instant::now(), None);
        Ok(())
    }

    fn at_head(&self) -> bool {
        self.trajectory.last().is_none_or(|r| r.frame == self.shown.index())
    }

    /// The next frame: one that was followed before, else one more.
    fn go_on(&mut self) {
        if self.go_back() {
            return self.check_goal();
        }
        let before = self.shown.time_s();
        let known = self.trajectory.after(self.shown.index()).map(|r| r.frame);
        let outcome = match known {
            Some(frame) => self.look_at(frame),
            None => self.follow(),
        };
        if let Err(refusal) = outcome {
            (self.phase, self.message) = (Phase::Failed, Some(refusal.message));
        }
        self.check_goal();
        let pause = self
            .speed
            .filter(|_| self.goal.is_none())
            .map_or(0.0, |speed| (self.shown.time_s() - before).clamp(0.0, 1.0) / speed);
        // A tracker that is slower than the pace does not hurry afterwards.
        self.due = (self.due + Duration::from_secs_f64(pause)).max(Instant::now());
    }

    /// Whether the frame to stop at has been reached.
    fn check_goal(&mut self) {
        let reached = |(frame, _): &(u64, Answer)| self.shown.index() >= *frame || self.phase != Phase::Running;
        if self.returning.is_none() && self.goal.as_ref().is_some_and(reached) {
            self.give_up_goal();
        }
    }

    fn follow(&mut self) -> Result<(), Refusal> {
        if matches!(self.phase, Phase::Ended | Phase::Failed) {
            return Ok(());
        }
        if self.is_recorded_whole()? {
            self.phase = Phase::Ended;
            return Ok(());
        }
        let began = Instant::now();
        match self.follower.step()? {
            // What was recorded of this frame stands.
            Some((_, row))
                if self.recorded.is_some() && self.trajectory.last().is_some_and(|r| r.frame >= row.frame) => {}
            Some((frame, row)) => {
                self.recorded = None;
                self.step_ms = 1e3 * began.elapsed().as_secs_f64();
                self.pictures.keep(&frame);
                self.trajectory.push(row);
                self.shown = frame;
                self.return_if_asked()?;
            }
            None => self.phase = Phase::Ended,
        }
        Ok(())
    }

    /// Shows a frame that was followed before.
    fn look_at(&mut self, frame: u64) -> Result<(), Refusal> {
        let frame = self.pictures.get(frame)?;
        self.shown = frame.ok_or_else(|| Refusal::conflict("this picture is no longer there"))?;
        Ok(())
    }

    /// Shows this frame, or of those that were followed the nearest.
    fn seek(&mut self, frame: u64) -> Result<(), Refusal> {
        self.pause();
        let first = self.trajectory.first().map_or(0, |r| r.frame);
        let last = self.trajectory.last().map_or(0, |r| r.frame);
        let known = self.trajectory.at(frame.clamp(first, last)).map(|r| r.frame);
        known.map_or(Ok(()), |frame| self.look_at(frame))
    }
}
