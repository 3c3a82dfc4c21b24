use super::engine::{Engine, Place};
use super::job::{Job, read_only};
use super::looks::Look;
use super::screen::{Screen, Viewer, Wish};
use crate::error::Refusal;
use crate::measuring::Bench;
use crate::recording::Known;
use crate::root::Root;
use pursuit::media::{Locator, OpenOptions, SourceInfo};
use pursuit::revise::{ChosenDetector, Edit, Input, Label, Row, Trajectory, Version};
use pursuit::toml::Table;
use pursuit::{BBox, Frame, Remote};
use serde_json::Value;
use std::collections::VecDeque;
use std::ops::RangeInclusive;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;
use tokio::sync::oneshot;

/// An input that does not answer for this long is not waited for.
const OPENING: Duration = Duration::from_secs(30);
/// Longest wait for an order to be obeyed: going far back in a long clip takes its time.
const OBEYING: Duration = Duration::from_secs(120);

/// What a trial is made of.
pub(crate) struct Setup {
    pub locator: Locator,
    pub options: OpenOptions,
    /// Below which files lie that parameters name.
    pub root: Root,
    pub tracker: String,
    pub parameters: Table,
    /// What finds the first target, where no box is to.
    pub seeking: Option<ChosenDetector>,
    /// What came of it already.
    pub known: Option<Known>,
    /// What it is measured with.
    pub bench: Bench,
    /// Where it is kept; nowhere without.
    pub place: Option<Place>,
    /// The name of the file that was uploaded, where it was.
    pub called: Option<String>,
}

/// How far a trial is and what it knows, for another that waits for it and is shown beside it.
#[derive(Default)]
pub(crate) struct Progress {
    /// One more than the frame followed last; 0 before the first.
    followed: AtomicU64,
    running: AtomicBool,
    rows: Mutex<Rows>,
}

/// A trajectory as it was told last.
#[derive(Default)]
struct Rows {
    revision: Option<u64>,
    rows: VecDeque<Arc<Row>>,
    step_ms: f64,
}

impl Progress {
    /// The trial is there now.
    pub fn tell(&self, trajectory: &Trajectory, running: bool, step_ms: f64) {
        self.share(trajectory, step_ms);
        self.followed.store(trajectory.last().map_or(0, |row| row.frame + 1), Ordering::Release);
        self.running.store(running, Ordering::Relaxed);
    }

    /// Nothing more comes.
    pub fn end(&self) {
        self.running.store(false, Ordering::Relaxed);
    }

    pub fn is_running(&self) -> bool {
        self.running.load(Ordering::Relaxed)
    }

    /// Whether it runs and has not come to this frame yet.
    pub fn is_behind(&self, frame: u64) -> bool {
        self.is_running() && self.followed.load(Ordering::Acquire) <= frame
    }

    /// What is known of this frame, and how long a frame takes, milliseconds.
    pub fn row(&self, frame: u64) -> (Option<Arc<Row>>, f64) {
        let shared = self.rows.lock().unwrap_or_else(PoisonError::into_inner);
        let at = shared.rows.binary_search_by_key(&frame, |row| row.frame).ok();
        (at.and_then(|at| shared.rows.get(at)).cloned(), shared.step_ms)
    }

    fn share(&self, trajectory: &Trajectory, step_ms: f64) {
        let mut shared = self.rows.lock().unwrap_or_else(PoisonError::into_inner);
        if shared.revision != Some(trajectory.revision()) {
            shared.rows = trajectory.rows().cloned().collect();
        } else {
            let last = shared.rows.back().map(|row| row.frame);
            let new: Vec<_> = trajectory.rows().rev().take_while(|row| Some(row.frame) > last).cloned().collect();
            shared.rows.extend(new.into_iter().rev());
            // Of a long trajectory the oldest are dropped.
            let excess = shared.rows.len().saturating_sub(trajectory.len());
            shared.rows.drain(..excess);
        }
        (shared.revision, shared.step_ms) = (Some(trajectory.revision()), step_ms);
    }
}

/// What a trial can be told.
pub(crate) enum Order {
    Start,
    Pause,
    Step,
    Back,
    Stop,
    /// Show this frame, following up to it where that has not been done.
    Seek(u64),
    /// Times the input's own pace; `None` for as fast as can be.
    Speed(Option<f64>),
    Add(BBox),
    /// This target is here; whether what came before is put right from here too.
    Correct(u64, BBox, bool),
    Remove(u64),
    Change(Table),
    Tracker(String, Table),
    /// Shows what this detector sees; without one, nothing.
    Detect(Option<ChosenDetector>),
    /// Look at frames in this way.
    Look(Look),
    Undo,
    Redo,
    /// Takes the trajectory in this file, whose form is seen by its content.
    Import(Vec<u8>),
    /// Names a target.
    Label(u64, Label),
    /// The first is the same target as the second, and is called so.
    Merge(u64, u64),
    /// From the frame shown on this is another target.
    Split(u64),
    /// In these frames each was taken for the other.
    Swap([u64; 2], RangeInclusive<u64>),
    /// Never goes ahead of this trial, while that one runs.
    Beside(Option<Arc<Progress>>),
    /// Says where it is.
    Tell,
}

pub(super) type Answer = oneshot::Sender<Result<Value, Refusal>>;

/// What reaches the engine.
pub(crate) enum Message {
    Obey(Order, Answer),
    /// Hands out a version by its number, or the current one.
    Version(Option<u32>, oneshot::Sender<Result<Told, Refusal>>),
    /// The frame of this number as JPEG.
    Picture(u64, oneshot::Sender<Result<Vec<u8>, Refusal>>),
    /// The frame that is shown.
    Shown(oneshot::Sender<Result<Arc<Frame>, Refusal>>),
    Quit,
}

/// A version with what is needed to write it down.
pub(crate) struct Told {
    pub version: Version,
    pub info: SourceInfo,
    pub edits: Vec<Edit>,
}

/// A trial that runs on a thread of its own, and ends when this is dropped; or a job that is only watched.
pub(crate) struct Trial {
    kind: Kind,
    pub screen: Arc<Screen>,
}

enum Kind {
    Own {
        messages: Sender<Message>,
        /// Of a live input, which is never opened a second time.
        remote: Remote,
        bench: Box<Mutex<Bench>>,
        progress: Arc<Progress>,
        input: Box<Input>,
        thread: Mutex<Option<JoinHandle<()>>>,
    },
    Job(Arc<Job>),
}

impl Drop for Trial {
    fn drop(&mut self) {
        if let Kind::Own { messages, remote, .. } = &self.kind {
            let _ = messages.send(Message::Quit);
            remote.stop();
        }
    }
}

/// Closes the screen when the thread of its trial ends, however it ends.
struct Closing(Arc<Screen>);

impl Drop for Closing {
    fn drop(&mut self) {
        self.0.close();
    }
}

impl Trial {
    /// Opens the input and shows its first frame.
    ///
    /// # Errors
    /// An input that cannot be read or says nothing, a method that there is not.
    pub async fn open(mut setup: Setup) -> Result<Self, Refusal> {
        let bench = Box::new(Mutex::new(std::mem::take(&mut setup.bench)));
        let input = Input::new(setup.locator.clone(), setup.options.clone());
        let system = |e: std::io::Error| Refusal::too_many(format!("the system gives no thread ({e}); close a trial"));
        let screen = Screen::open().map_err(system)?;
        let (messages, inbox) = channel();
        let (opened, told) = oneshot::channel();
        let painted = screen.clone();
        let progress = Arc::new(Progress::default());
        let told_of = progress.clone();
        let run = move || {
            let screen = Closing(painted);
            match Engine::open(setup, screen.0.clone(), told_of) {
                Ok(engine) => {
                    if opened.send(Ok(engine.remote())).is_ok() {
                        engine.run(&inbox);
                    }
                }
                Err(refusal) => drop(opened.send(Err(refusal))),
            }
        };
        let thread = std::thread::Builder::new().name("trial".to_owned()).spawn(run).map_err(system)?;
        let (thread, input) = (Mutex::new(Some(thread)), Box::new(input));
        match tokio::time::timeout(OPENING, told).await {
            Ok(Ok(outcome)) => outcome
                .map(|remote| Self { kind: Kind::Own { messages, remote, bench, progress, input, thread }, screen }),
            Ok(Err(_)) => Err(Refusal::unfit("this source cannot be opened; please report it")),
            Err(_) => Err(Refusal::unfit(format!("the source said nothing for {} s", OPENING.as_secs()))),
        }
    }

    /// A job that is watched.
    pub fn watching(job: Arc<Job>) -> Self {
        let screen = job.screen().clone();
        Self { kind: Kind::Job(job), screen }
    }

    /// Has an order obeyed, and says where the trial is then.
    pub async fn order(&self, order: Order) -> Result<Value, Refusal> {
        match &self.kind {
            Kind::Own { messages, .. } => ask(messages, |answer| Message::Obey(order, answer)).await,
            Kind::Job(job) => job.order(&order),
        }
    }

    pub async fn version(&self, number: Option<u32>) -> Result<Told, Refusal> {
        match &self.kind {
            Kind::Own { messages, .. } => ask(messages, |answer| Message::Version(number, answer)).await,
            Kind::Job(job) => job.version(number),
        }
    }

    /// What it follows in, to be read once more.
    pub fn input(&self) -> Result<&Input, Refusal> {
        match &self.kind {
            Kind::Own { input, .. } => Ok(input),
            Kind::Job(_) => Err(read_only()),
        }
    }

    /// How far it is.
    pub fn progress(&self) -> Option<Arc<Progress>> {
        match &self.kind {
            Kind::Own { progress, .. } => Some(progress.clone()),
            Kind::Job(_) => None,
        }
    }

    /// Whether it is following, or playing.
    pub fn is_running(&self) -> bool {
        self.progress().is_some_and(|progress| progress.is_running())
    }

    /// Ends it, and waits until all that it knows is kept.
    pub fn end(&self) {
        if let Kind::Own { messages, remote, thread, .. } = &self.kind {
            let _ = messages.send(Message::Quit);
            remote.stop();
            let thread = thread.lock().unwrap_or_else(PoisonError::into_inner).take();
            // A thread that panicked has said so.
            let _ = thread.map(JoinHandle::join);
        }
    }

    pub async fn picture(&self, frame: u64) -> Result<Vec<u8>, Refusal> {
        match &self.kind {
            Kind::Own { messages, .. } => ask(messages, |answer| Message::Picture(frame, answer)).await,
            Kind::Job(job) => job.picture(frame),
        }
    }

    /// The frame that is shown.
    pub async fn shown(&self) -> Result<Arc<Frame>, Refusal> {
        match &self.kind {
            Kind::Own { messages, .. } => ask(messages, Message::Shown).await,
            Kind::Job(_) => Err(read_only()),
        }
    }

    /// What it is measured with; a job that is watched is not measured.
    pub fn bench(&self) -> Result<MutexGuard<'_, Bench>, Refusal> {
        match &self.kind {
            Kind::Own { bench, .. } => Ok(bench.lock().unwrap_or_else(PoisonError::into_inner)),
            Kind::Job(_) => Err(read_only()),
        }
    }

    pub fn viewer(&self, wish: Wish) -> Viewer {
        self.screen.viewer(wish)
    }
}

async fn ask<T>(
    messages: &Sender<Message>,
    message: impl FnOnce(oneshot::Sender<Result<T, Refusal>>) -> Message,
) -> Result<T, Refusal> {
    let (answer, told) = oneshot::channel();
    let over = || Refusal::new(axum::http::StatusCode::GONE, "this trial is over; open its source again");
    messages.send(message(answer)).map_err(|_| over())?;
    match tokio::time::timeout(OBEYING, told).await {
        Ok(answer) => answer.unwrap_or_else(|_| Err(over())),
        Err(_) => Err(Refusal::conflict("this takes long; look again later")),
    }
}
