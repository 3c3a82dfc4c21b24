//! One tracker on one sequence.

use crate::clock::ThreadClock;
use crate::frame_cache::FrameCache;
use crate::metrics::accuracy::overlap;
use crate::metrics::masks::MaskFigures;
use crate::metrics::supervised::SKIP_AFTER_FAILURE;
use crate::metrics::{mean, quantile};
use crate::protocol::Pass;
use crate::{EvaluationError, Output, Protocol, Result, Sequence, Trajectory, Truth};
use pursuit_geometry::{BBox, Mask};
use pursuit_imaging::Frame;
use pursuit_tracking::many::Elapsed;
use pursuit_tracking::{MultiTracker, Recipe, TargetId, TargetSet, Track, TrackState};
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// What is kept beside the boxes: `boxes/TRACKER/SEQUENCE.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunRecord {
    /// The tracker's registry name.
    pub tracker: String,
    /// Every parameter it ran with.
    pub parameters: serde_json::Value,
    /// What made the run: results of another build are not reused.
    pub build: String,
    /// The protocol it ran under.
    pub protocol: Protocol,
    /// Bytes of the footage as files: results of a clip that was coded anew, or of other images, are not reused. `None` where they cannot
    /// be counted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub footage_bytes: Option<u64>,
    /// The box that the first start was given: left, top, width, height. `None` where that is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start_box: Option<(f64, f64, f64, f64)>,
    /// Frames of the sequence that could be had, counted from its first.
    pub frames: usize,
    /// Frames on which the tracker was started.
    pub starts: Vec<usize>,
    /// Frames in which it failed (reset protocol).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub failures: Vec<usize>,
    /// Mean time of a start, in milliseconds on the wall.
    pub init_ms: f64,
    /// Time of an update; `None` when there was none.
    pub update: Option<UpdateTime>,
    /// What its masks were worth, in the frames after the starts whose true mask is known; empty where it said none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub masks: Vec<MaskFigures>,
    /// What stopped it early.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
}

impl RunRecord {
    /// Whether its first start was given this box, to a millionth of a pixel.
    pub(crate) fn starts_at(&self, bbox: &BBox) -> bool {
        let is_near = |a: f64, b: f64| (a - b).abs() < 1e-6;
        let (left, top, width, height) = bbox.ltwh();
        self.start_box
            .is_some_and(|(l, t, w, h)| is_near(l, left) && is_near(t, top) && is_near(w, width) && is_near(h, height))
    }
}

/// What one tracker left on one sequence: every pass of the protocol.
pub(crate) type Passes = Vec<(Trajectory, RunRecord)>;

/// Time of an update in milliseconds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct UpdateTime {
    /// Updates measured.
    pub count: usize,
    /// Mean processor time of the tracker's one thread: what `fps` is made of.
    pub mean_ms: f64,
    /// Mean time on the wall.
    pub wall_ms: f64,
    /// Median time on the wall.
    pub p50_ms: f64,
    /// 95 % quantile of the time on the wall.
    pub p95_ms: f64,
    /// 99 % quantile of the time on the wall.
    pub p99_ms: f64,
}

impl UpdateTime {
    /// Updates a second, by processor time.
    pub fn fps(&self) -> f64 {
        // A tracker that does nothing is below the clock's resolution; a nanosecond is the least that can be said.
        1e3 / self.mean_ms.max(1e-6)
    }

    /// Updates a second, by the clock on the wall.
    pub fn fps_wall(&self) -> f64 {
        1e3 / self.wall_ms.max(1e-6)
    }

    /// Of updates that took `wall_ms` each and `thread_ms` of processor time together; `None` of none.
    pub(crate) fn of(wall_ms: &[f64], thread_ms: f64) -> Option<Self> {
        let at = |q| quantile(wall_ms, q);
        Some(Self {
            count: wall_ms.len(),
            mean_ms: thread_ms / wall_ms.len() as f64,
            wall_ms: mean(wall_ms),
            p50_ms: at(0.5)?,
            p95_ms: at(0.95)?,
            p99_ms: at(0.99)?,
        })
    }
}

/// A run in progress.
struct Running<'a> {
    recipe: &'a dyn Recipe,
    sequence: &'a Sequence,
    protocol: Protocol,
    /// The same step as any run takes, with one target.
    targets: TargetSet,
    target: Option<TargetId>,
    tracks: Vec<Track>,
    clock: Arc<ThreadClock>,
    next_start: Option<(usize, Option<BBox>)>,
    trajectory: Trajectory,
    starts: Vec<usize>,
    failures: Vec<usize>,
    start_ms: Vec<f64>,
    wall_ms: Vec<f64>,
    thread_ms: f64,
    masks: Vec<MaskFigures>,
    /// Whether a mask was ever said.
    masked: bool,
    error: Option<String>,
}

/// Runs a tracker over a sequence; `None` when `stop` was set on the way.
///
/// # Errors
/// Footage that cannot be opened. An error or a panic of the tracker ends the run and is kept in the record.
pub(crate) fn run_pass(
    recipe: &dyn Recipe,
    sequence: &Sequence,
    frames: &FrameCache<'_>,
    pass: &Pass,
    protocol: Protocol,
    build: &str,
    stop: &AtomicBool,
) -> Result<Option<(Trajectory, RunRecord)>> {
    let clock = Arc::new(ThreadClock::default());
    let mut running = Running {
        recipe,
        sequence,
        protocol,
        targets: TargetSet::timed_by(clock.clone()),
        target: None,
        tracks: Vec::new(),
        clock,
        next_start: Some((pass.start, Some(pass.bbox))),
        trajectory: Trajectory::silent(sequence.truth().len()),
        starts: Vec::new(),
        failures: Vec::new(),
        start_ms: Vec::new(),
        wall_ms: Vec::with_capacity(sequence.truth().len()),
        thread_ms: 0.0,
        masks: Vec::new(),
        masked: false,
        error: None,
    };
    let ending = frames.show(pass.start, |i, frame| {
        if stop.load(Ordering::Relaxed) {
            return ControlFlow::Break(());
        }
        match catch_unwind(AssertUnwindSafe(|| running.step(i, &frame))) {
            Ok(Ok(())) => return ControlFlow::Continue(()),
            Ok(Err(e)) => running.error = Some(format!("frame {i}: {e}")),
            Err(panic) => running.error = Some(format!("frame {i}: the tracker panicked: {}", words_of(&*panic))),
        }
        ControlFlow::Break(())
    })?;
    if stop.load(Ordering::Relaxed) {
        return Ok(None);
    }
    let parameters = parameters_of(recipe)?;
    // When the tracker gave up, the frames after it are there all the same and count against it.
    let frames = if running.error.is_some() { sequence.truth().len() } else { ending.frames };
    let record = RunRecord {
        tracker: recipe.name().to_owned(),
        parameters,
        build: build.to_owned(),
        protocol,
        footage_bytes: sequence.footage().bytes(),
        start_box: Some(pass.bbox.ltwh()),
        frames,
        init_ms: mean(&running.start_ms),
        update: running.update_time(),
        starts: running.starts,
        failures: running.failures,
        masks: if running.masked { running.masks } else { Vec::new() },
        error: running.error.or(ending.broken),
    };
    Ok(Some((running.trajectory, record)))
}

/// Every parameter of a recipe.
pub(crate) fn parameters_of(recipe: &dyn Recipe) -> Result<serde_json::Value> {
    let failed =
        |e: &dyn std::fmt::Display| EvaluationError::encoding(format!("the parameters of {}", recipe.name()), e);
    let table = recipe.parameters().map_err(|e| failed(&e))?;
    serde_json::to_value(table).map_err(|e| failed(&e))
}

impl Running<'_> {
    fn step(&mut self, i: usize, frame: &Frame) -> Result<(), String> {
        let truth = self.sequence.truth().get(i).and_then(|t| t.bbox());
        if let Some((when, given)) = self.next_start {
            return match given.or(truth) {
                Some(bbox) if i >= when => self.start(i, frame, bbox),
                _ => Ok(()),
            };
        }
        self.targets.step(frame, &mut self.tracks).map_err(|e| e.to_string())?;
        let Some(Track { estimate: Some(estimate), elapsed, .. }) = self.tracks.first() else { return Ok(()) };
        let output = Output::from(estimate);
        if !output.bbox.is_finite() || !output.score.is_finite() {
            return Err(format!("the tracker reported box {} with score {}", output.bbox, output.score));
        }
        self.wall_ms.push(elapsed.wall_ms);
        self.thread_ms += elapsed.thread_ms;
        self.trajectory.set(i, output);
        if let Some(true_mask) = self.sequence.mask(i) {
            self.masked |= estimate.mask.is_some();
            let none = Mask::default();
            let said = estimate.mask.as_deref().unwrap_or(&none);
            self.masks.push(MaskFigures::of(said, true_mask, frame.size()));
        }
        let missed = truth.is_some_and(|t| overlap(&Truth::Visible(t), Some(&output)) <= 0.0);
        if self.protocol == Protocol::Reset && missed {
            self.failures.push(i);
            self.target.take().map(|id| self.targets.remove(id)).transpose().map_err(|e| e.to_string())?;
            self.next_start = Some((i + SKIP_AFTER_FAILURE, None));
        }
        Ok(())
    }

    fn start(&mut self, i: usize, frame: &Frame, bbox: BBox) -> Result<(), String> {
        let (targets, recipe) = (&mut self.targets, self.recipe);
        let (target, elapsed) = Elapsed::of(&*self.clock, || targets.add(recipe, frame, bbox));
        self.target = Some(target.map_err(|e| e.to_string())?);
        self.next_start = None;
        self.starts.push(i);
        self.start_ms.push(elapsed.wall_ms);
        self.trajectory.set(i, Output { bbox, state: TrackState::Tracking, score: 1.0 });
        Ok(())
    }

    fn update_time(&self) -> Option<UpdateTime> {
        UpdateTime::of(&self.wall_ms, self.thread_ms)
    }
}

fn words_of(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|s| (*s).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "without a message".to_owned())
}
