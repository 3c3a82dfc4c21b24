use crate::run_file::{StateCounts, TimingFacts};
use crate::sinks::Sink;
use crate::{Record, RunError, Timing};
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_media::Source;
use pursuit_tracking::{Detector, Estimate, Recipe, TargetId, TargetSet, TrackState, TrackingError};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// How a session gets its first targets.
pub enum Start {
    /// One target for each box, in the first frame.
    Boxes(Vec<BBox>),
    /// Whatever the detector finds first, in whatever frame.
    Detector(Box<dyn Detector>),
}

/// The one run loop: source → trackers → sinks.
///
/// Sinks are called in order for every frame and may block: that is the back-pressure (a live source drops frames
/// meanwhile, and counts them).
pub struct Session<'a> {
    source: Box<dyn Source>,
    recipe: &'a dyn Recipe,
    start: Start,
    sinks: Vec<Box<dyn Sink>>,
    stop: &'a AtomicBool,
}

/// How a session ended.
#[derive(Debug)]
pub struct Outcome {
    /// Frames looked at.
    pub frames: u64,
    /// Frames of all targets by state.
    pub states: StateCounts,
    /// How long things took.
    pub timing: TimingFacts,
    /// Whether it was stopped from outside.
    pub interrupted: bool,
    /// What ended it early: a broken input, or an output that cannot be written.
    pub failure: Option<RunError>,
}

/// What an observer is told after each frame.
#[derive(Debug, Clone, Copy)]
pub struct Progress<'a> {
    /// Frames looked at so far.
    pub frames: u64,
    /// What is known of each target in this frame.
    pub records: &'a [Record],
}

impl<'a> Session<'a> {
    /// A session about to run. `stop` ends it after the frame in hand once it becomes true.
    pub fn new(
        source: Box<dyn Source>,
        recipe: &'a dyn Recipe,
        start: Start,
        sinks: Vec<Box<dyn Sink>>,
        stop: &'a AtomicBool,
    ) -> Self {
        Self { source, recipe, start, sinks, stop }
    }

    /// Runs until the input ends, something breaks, or it is stopped; closes every sink properly in any case.
    pub fn run(mut self, mut observe: impl FnMut(Progress<'_>)) -> Outcome {
        let mut run =
            Run { states: StateCounts::default(), update: Timing::default(), decode: Timing::default(), frames: 0 };
        let began = Instant::now();
        let ended = self.follow(&mut run, &mut observe);
        let interrupted = matches!(ended, Ok(Ended::Stopped));
        let mut failure = ended.err();
        for sink in &mut self.sinks {
            // The first thing that went wrong is the one to report; a sink that failed before fails again here.
            let finished = sink.finish();
            failure = failure.or(finished.err());
        }
        let timing = TimingFacts {
            update_ms: run.update.summary(),
            decode_ms: run.decode.summary(),
            total_s: began.elapsed().as_secs_f64(),
        };
        Outcome { frames: run.frames, states: run.states, timing, interrupted, failure }
    }

    fn follow(&mut self, run: &mut Run, observe: &mut impl FnMut(Progress<'_>)) -> Result<Ended, RunError> {
        let mut targets = TargetSet::new();
        loop {
            if self.stop.load(Ordering::Relaxed) {
                return Ok(Ended::Stopped);
            }
            let waited = Instant::now();
            let Some(frame) = self.source.next_frame()? else {
                return Ok(if self.stop.load(Ordering::Relaxed) { Ended::Stopped } else { Ended::Input });
            };
            run.decode.add(ms_since(waited));
            let frame = Arc::new(frame);
            let records =
                if targets.is_empty() { self.begin(&frame, &mut targets)? } else { update(&mut targets, &frame, run)? };
            run.frames += 1;
            for record in &records {
                run.states.add(record.estimate.as_ref().map_or(TrackState::Lost, |e| e.state));
            }
            for sink in &mut self.sinks {
                sink.write(&frame, &records)?;
            }
            observe(Progress { frames: run.frames, records: &records });
        }
    }

    /// Starts on the boxes given, or on what the detector finds in this frame.
    fn begin(&mut self, frame: &Frame, targets: &mut TargetSet) -> Result<Vec<Record>, RunError> {
        let began = Instant::now();
        let found: Vec<(BBox, f64)> = match &mut self.start {
            Start::Boxes(boxes) => boxes.iter().map(|b| (*b, 1.0)).collect(),
            Start::Detector(detector) => {
                detector.detect(frame, &[])?.first().map(|d| (d.bbox, d.confidence)).into_iter().collect()
            }
        };
        if found.is_empty() {
            return Ok(vec![record(frame, TargetId(1), None, Some(ms_since(began)))]);
        }
        found
            .into_iter()
            .map(|(bbox, score)| {
                let began = Instant::now();
                let id = targets.add(self.recipe, frame, bbox)?;
                Ok(record(frame, id, Some(Estimate::started(frame.time_s(), bbox, score)), Some(ms_since(began))))
            })
            .collect()
    }
}

enum Ended {
    Input,
    Stopped,
}

struct Run {
    states: StateCounts,
    update: Timing,
    decode: Timing,
    frames: u64,
}

fn update(targets: &mut TargetSet, frame: &Frame, run: &mut Run) -> Result<Vec<Record>, RunError> {
    let updated = targets.update(frame, |id, update| {
        let began = Instant::now();
        let estimate = update();
        (id, estimate, ms_since(began))
    });
    updated
        .into_iter()
        .map(|(id, estimate, ms)| {
            run.update.add(ms);
            Ok(record(frame, id, Some(estimate?), Some(ms)))
        })
        .collect::<Result<_, TrackingError>>()
        .map_err(RunError::from)
}

fn record(frame: &Frame, target: TargetId, estimate: Option<Estimate>, update_ms: Option<f64>) -> Record {
    Record { frame: frame.index(), time_s: frame.time_s(), target, estimate, update_ms }
}

fn ms_since(instant: Instant) -> f64 {
    instant.elapsed().as_secs_f64() * 1e3
}
