//! The one run loop, by steps.

mod age;
mod checkpoint;
mod clocked;
mod command;
mod counts;
mod damage;
mod obeying;
mod outcome;
mod placing;
mod story;

pub(crate) use checkpoint::Checkpoint;
pub use command::{Command, Remote, Reply};
pub use damage::Damage;
pub use outcome::{Outcome, Progress};

use crate::events::Watcher;
use crate::sinks::{Moment, Sink};
use crate::view::{estimate_in_input, forecast_in_input, pose_of_input};
use crate::{Record, RunError};
use command::Inbox;
use counts::Counts;
use placing::Placement;
use pursuit_imaging::{CameraPose, Frame};
use pursuit_media::{Source, View};
use pursuit_tracking::many::{Acquiring, AcquisitionParams, Elapsed, WallClock};
use pursuit_tracking::{Class, Detector, MultiTracker, Recipe, TargetId, TargetSet, Track};
use std::sync::Arc;
use std::time::Instant;
use story::Story;

/// The one run loop: source → trackers → sinks, a frame a step.
///
/// All boxes, those that it is given and those that it hands on, are in pixels of the whole input, also where the source
/// shows a part of it ([`part_of`](crate::part_of)).
///
/// Sinks are called in order for every frame and may block: that is the back-pressure (a live source drops frames
/// meanwhile, and counts them). Between two steps [`Command`]s are obeyed, from the owner ([`apply`](Self::apply)) or from
/// elsewhere ([`remote`](Self::remote)).
///
/// ```
/// use pursuit::tracking::TrackState;
/// use pursuit::{BBox, Session, open, recipe};
///
/// let source = open("scene:drift?seed=7&duration=1")?;
/// let first = source.info().truth_at(0).bbox().expect("the scene begins with its target");
/// let mut session = Session::new(source, recipe("mosse")?).starting_on(vec![first]);
/// while let Some(progress) = session.step()? {
///     let record = &progress.records[0];
///     assert_eq!(record.estimate.as_ref().map(|e| e.state), Some(TrackState::Tracking));
/// }
/// assert_eq!(session.finish().frames, 30);
/// # Ok::<(), pursuit::RunError>(())
/// ```
pub struct Session {
    source: Box<dyn Source>,
    /// The part of the input that the source shows; trackers know no other pixels than those of the part.
    view: Option<View>,
    recipe: Box<dyn Recipe>,
    targets: Box<dyn MultiTracker>,
    /// Whether the targets' trackers are made by the recipe, so that its parameters are theirs.
    by_recipe: bool,
    /// What is to be put onto the next frame.
    pending: Vec<Placement>,
    sinks: Vec<Box<dyn Sink>>,
    inbox: Inbox,
    remote: Remote,
    paused: bool,
    ended: Option<Ended>,
    /// The frame looked at last; none before the first, and after going elsewhere.
    frame: Option<Arc<Frame>>,
    /// Whether that frame has been looked at and not yet handed on.
    ready: bool,
    tracks: Vec<Track>,
    /// What targets are called that no detector names: by their trackers, where several follow one thing.
    names: Vec<(TargetId, Class)>,
    records: Vec<Record>,
    began: Instant,
    counts: Counts,
    damage: Damage,
    story: Story,
    /// Where what the targets know is written down.
    checkpoint: Option<Checkpoint>,
    /// How the camera stood when the frame of a time was taken.
    poses: Option<Box<dyn FnMut(f64) -> Option<CameraPose> + Send>>,
    /// Says what happens.
    watcher: Option<Watcher>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Ended {
    Input,
    Stopped,
    Failed,
}

impl Session {
    /// A session without targets yet, whose trackers `recipe` makes.
    pub fn new(source: Box<dyn Source>, recipe: Box<dyn Recipe>) -> Self {
        let (inbox, remote) = command::channel(source.stop_handle());
        Self {
            view: source.info().view,
            source,
            recipe,
            targets: Box::new(TargetSet::new()),
            by_recipe: true,
            pending: Vec::new(),
            sinks: Vec::new(),
            inbox,
            remote,
            paused: false,
            ended: None,
            frame: None,
            ready: false,
            tracks: Vec::new(),
            names: Vec::new(),
            records: Vec::new(),
            began: Instant::now(),
            counts: Counts::default(),
            damage: Damage::default(),
            story: Story::default(),
            checkpoint: None,
            poses: None,
            watcher: None,
        }
    }

    /// One target, which `detector` finds and which is made sure of while it is followed.
    ///
    /// # Errors
    /// A parameter out of range.
    pub fn finding(mut self, detector: Box<dyn Detector>, params: AcquisitionParams) -> Result<Self, RunError> {
        self.targets = Box::new(Acquiring::new(self.clocked(detector), self.recipe.boxed_clone(), params)?);
        Ok(self)
    }

    /// The detector with its time taken, for targets that are given to [`following`](Self::following).
    #[must_use]
    pub fn clocked(&self, detector: Box<dyn Detector>) -> Box<dyn Detector> {
        self.counts.detect.of(detector)
    }

    /// Any other way to follow targets.
    #[must_use]
    pub fn following(self, targets: Box<dyn MultiTracker>) -> Self {
        Self { targets, by_recipe: false, ..self }
    }

    /// Goes on with targets whose trackers the recipe made in an earlier session.
    pub(crate) fn continuing(self, targets: Box<dyn MultiTracker>, by_recipe: bool) -> Self {
        Self { targets, by_recipe, ..self }
    }

    /// Writes down what the targets know now and then, and when it is interrupted.
    pub(crate) fn kept_in(self, checkpoint: Option<Checkpoint>) -> Self {
        Self { checkpoint, ..self }
    }

    /// Sinks are told what happens, too.
    pub(crate) fn watching(self, watcher: Option<Watcher>) -> Self {
        Self { watcher, ..self }
    }

    /// Where results go, in this order.
    #[must_use]
    pub fn with_sinks(self, sinks: Vec<Box<dyn Sink>>) -> Self {
        Self { sinks, ..self }
    }

    /// Says of each frame how the camera stood when it was taken, by the frame's time in seconds, as a pan-tilt head knows it;
    /// what a frame says of itself stands. It is asked when the frame is about to be looked at.
    #[must_use]
    pub fn posed_by(self, poses: Box<dyn FnMut(f64) -> Option<CameraPose> + Send>) -> Self {
        Self { poses: Some(poses), ..self }
    }

    /// Commands and stops the session from anywhere, any thread or a signal handler.
    pub fn remote(&self) -> Remote {
        self.remote.clone()
    }

    /// Whether [`run`](Self::run) waits for [`Command::Resume`]. [`step`](Self::step) goes a frame on all the same.
    pub const fn is_paused(&self) -> bool {
        self.paused
    }

    /// The frame looked at last; none before the first, and after [`Command::Seek`].
    pub const fn frame(&self) -> Option<&Arc<Frame>> {
        self.frame.as_ref()
    }

    /// The targets, to look at; in pixels of the frames.
    pub fn targets(&self) -> &dyn MultiTracker {
        &*self.targets
    }

    /// Looks at the first frame and starts the targets in it, so that a box or an input that cannot be used is known before
    /// any output is opened: sinks given afterwards are handed this frame too, by the next [`step`](Self::step).
    ///
    /// # Errors
    /// As [`step`](Self::step).
    pub fn start(&mut self) -> Result<(), RunError> {
        if self.frame.is_none() && self.ended.is_none() {
            self.ready = self.advance()?;
        }
        Ok(())
    }

    /// Obeys what came from [`remote`](Self::remote), looks at the next frame, and hands the results to the sinks. `None`
    /// once the input has ended or the session was stopped.
    ///
    /// # Errors
    /// An input that breaks off, a frame that cannot be used, an output that cannot be written; the session is over then.
    pub fn step(&mut self) -> Result<Option<Progress<'_>>, RunError> {
        self.obey();
        if self.ended.is_some() || !(std::mem::take(&mut self.ready) || self.advance()?) {
            return Ok(None);
        }
        if let Err(failure) = self.emit() {
            // A frame whose results are not whole is looked at again, by whoever goes on from what was written down before.
            (self.ended, self.checkpoint) = (Some(Ended::Failed), None);
            return Err(failure);
        }
        Ok(self.progress())
    }

    /// Looks at the next frame; false once there is none.
    fn advance(&mut self) -> Result<bool, RunError> {
        let looked = self.look();
        match &looked {
            Ok(true) => {}
            Ok(false) => self.ended = Some(if self.remote.is_stopped() { Ended::Stopped } else { Ended::Input }),
            Err(_) => self.ended = Some(Ended::Failed),
        }
        looked
    }

    /// Runs until the input ends, something breaks, or it is stopped; closes every sink properly in any case.
    pub fn run(mut self, mut observe: impl FnMut(Progress<'_>)) -> Outcome {
        let failure = loop {
            self.obey();
            while self.paused && self.ended.is_none() {
                self.wait();
            }
            match self.step() {
                Ok(Some(progress)) => observe(progress),
                Ok(None) => break None,
                Err(e) => break Some(e),
            }
        };
        self.close(failure)
    }

    /// Closes every sink properly, and says how it went.
    pub fn finish(self) -> Outcome {
        self.close(None)
    }

    fn close(mut self, mut failure: Option<RunError>) -> Outcome {
        match (&mut self.checkpoint, &self.frame) {
            (Some(checkpoint), _) if failure.is_none() && self.ended == Some(Ended::Input) => checkpoint.discard(),
            (Some(checkpoint), Some(frame)) if !self.ready => checkpoint.write(frame.index(), &*self.targets),
            _ => {}
        }
        for sink in &mut self.sinks {
            // The first thing that went wrong is the one to report; a sink that failed before fails again here.
            let finished = sink.finish();
            failure = failure.or(finished.err());
        }
        let timing = self.counts.timing(self.began.elapsed().as_secs_f64());
        let interrupted = self.ended == Some(Ended::Stopped);
        let failure = failure.or_else(|| self.damage.first().cloned().map(RunError::from));
        let (frames, states) = (self.counts.frames, self.counts.states);
        let age_ms = self.counts.age.summary();
        Outcome { frames, states, timing, age_ms, interrupted, damage: self.damage, failure }
    }

    /// Reads a frame and follows the targets into it; false after the last.
    fn look(&mut self) -> Result<bool, RunError> {
        let (frame, waited) = Elapsed::of(&WallClock::default(), || self.next_frame());
        let Some(frame) = frame? else { return Ok(false) };
        self.counts.decode.add(waited.wall_ms);
        self.counts.taken(self.began.elapsed().as_secs_f64(), &frame, self.source.info().live);
        let pose = if frame.camera().is_none() { self.poses.as_mut().and_then(|p| p(frame.time_s())) } else { None };
        let pose = pose.and_then(|pose| self.view.map_or(Some(pose), |view| pose_of_input(&view, &pose)));
        let frame = Arc::new(match pose {
            Some(pose) => frame.with_camera(pose),
            None => frame,
        });
        let (stepped, looked) = Elapsed::of(&WallClock::default(), || self.targets.step(&frame, &mut self.tracks));
        stepped?;
        self.counts.look.add(looked.wall_ms);
        for placement in std::mem::take(&mut self.pending) {
            match placement {
                Placement::Add(.., from) if from > frame.index() => self.pending.push(placement),
                due => self.place(&frame, due)?,
            }
        }
        self.frame = Some(frame.clone());
        self.counts.frames += 1;
        self.records.clear();
        for mut track in self.tracks.drain(..) {
            self.counts.followed(&track);
            if let Some((_, name)) = self.names.iter().find(|(id, _)| *id == track.id) {
                track.class = Some(name.clone());
            }
            if let Some(view) = &self.view {
                track.estimate = track.estimate.map(|estimate| estimate_in_input(view, estimate));
            }
            self.records.push(Record::new(&frame, track));
        }
        if tracing::enabled!(tracing::Level::INFO) {
            self.story.tell(&self.records, |text| tracing::info!("{text}"));
        }
        Ok(true)
    }

    /// The next frame that can be had. Frames that cannot are kept account of; the targets see by its time what they missed.
    fn next_frame(&mut self) -> Result<Option<Frame>, RunError> {
        loop {
            match self.source.next_frame() {
                Err(damage) if damage.is_damage() => {
                    tracing::info!("{damage}");
                    self.damage.add(damage);
                }
                other => return Ok(other?),
            }
        }
    }

    /// Hands the results to the sinks.
    fn emit(&mut self) -> Result<(), RunError> {
        let Some(frame) = &self.frame else { return Ok(()) };
        let targets = &*self.targets;
        // Whether a tracker can say so is its own affair: a sink does without.
        let view = self.view;
        let forecast = |target, seconds| {
            let forecast = targets.forecast(target, seconds).ok()?;
            Some(match &view {
                Some(view) => forecast_in_input(view, &forecast),
                None => forecast,
            })
        };
        if let Some(watcher) = &mut self.watcher {
            watcher.look(frame.index(), frame.time_s(), &self.records)?;
        }
        let watched = self.watcher.as_ref().map(Watcher::watched);
        let moment = Moment::new(frame, &self.records, &forecast).with_watched(watched);
        self.sinks.iter_mut().try_for_each(|sink| sink.write(&moment))?;
        self.counts.handed_on(self.began.elapsed().as_secs_f64());
        // Only of frames whose results have been handed on, so that no line is missing later.
        if let Some(checkpoint) = &mut self.checkpoint {
            checkpoint.keep(frame.index(), &*self.targets);
        }
        Ok(())
    }

    fn progress(&self) -> Option<Progress<'_>> {
        let frame = self.frame.as_ref()?;
        Some(Progress { frames: self.counts.frames, frame, records: &self.records })
    }
}
