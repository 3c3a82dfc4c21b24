//! Several trackers on one target: what each said, beside what the first said and what is true.

use crate::config::RunConfig;
use crate::run::{StateCounts, Timing, TimingSummary};
use crate::{Record, RunError};
use pursuit_evaluation::metrics::accuracy::{Accuracy, AccuracyMeter};
use pursuit_geometry::{BBox, Truth};
use pursuit_tracking::{TargetId, TrackState};
use serde::Serialize;

/// How one of the trackers did.
#[derive(Debug, Clone, Serialize)]
pub struct ComparedFacts {
    /// Its target in the trajectory.
    pub target: u64,
    /// Its name.
    pub tracker: String,
    /// How many frames were in each state.
    pub states: StateCounts,
    /// Time of its updates in milliseconds, beside those of the others.
    pub update_ms: TimingSummary,
    /// Mean overlap with the first tracker's box, over the frames in which neither has lost the target; `None` of the first, and
    /// where there is no such frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub agreement: Option<f64>,
    /// Accuracy against the truth that came with the input.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub accuracy: Option<Accuracy>,
}

impl RunConfig {
    /// Whether several trackers can start as the run does.
    ///
    /// # Errors
    /// [`RunError::Usage`] saying what stands against it.
    pub(crate) fn check_compare(&self) -> Result<(), RunError> {
        let names: Vec<&String> = self.tracker.iter().chain(&self.compare).collect();
        let twice = names.iter().enumerate().find(|(i, name)| names.iter().take(*i).any(|before| before == *name));
        let problem = if self.compare.is_empty() {
            return Ok(());
        } else if let Some((_, name)) = twice {
            return Err(RunError::usage(format!("the tracker {name} is named twice; compare it with others")));
        } else if self.detects() {
            "trackers are compared on one box; give it with `--box` or `--pick`, and leave the detector out"
        } else if self.boxes.len() > 1 {
            "trackers are compared on one target; give one box"
        } else if self.resume == Some(true) {
            "a comparison is not resumed; begin it anew"
        } else {
            return Ok(());
        };
        Err(RunError::usage(problem))
    }
}

/// What is kept of one tracker while the run goes on.
struct Line {
    name: String,
    begun: bool,
    states: StateCounts,
    update: Timing,
    meter: AccuracyMeter,
    overlaps: f64,
    together: u64,
}

/// Gathers how the trackers do; their targets are numbered from 1 in their order.
pub(crate) struct Scoreboard(Vec<Line>);

impl Scoreboard {
    /// For trackers of these names; for none where they are not several.
    pub fn new(names: Vec<String>) -> Self {
        let line = |name| Line {
            name,
            begun: false,
            states: StateCounts::default(),
            update: Timing::default(),
            meter: AccuracyMeter::default(),
            overlaps: 0.0,
            together: 0,
        };
        Self(if names.len() > 1 { names.into_iter().map(line).collect() } else { Vec::new() })
    }

    /// Takes the records of a frame.
    pub fn add(&mut self, records: &[Record], truth: Option<Truth>) {
        let held = |record: &Record| record.estimate.as_ref().filter(|e| e.state != TrackState::Lost).map(|e| e.bbox);
        let first: Option<BBox> = records.iter().find(|r| r.target == TargetId(1)).and_then(held);
        for (line, number) in self.0.iter_mut().zip(1..) {
            let Some(record) = records.iter().find(|r| r.target == TargetId(number)) else { continue };
            let Some(estimate) = &record.estimate else { continue };
            // In its first frame it was started, which is no update.
            record.update_ms.iter().filter(|_| line.begun).for_each(|ms| line.update.add(*ms));
            line.begun = true;
            line.states.add(estimate.state);
            truth.into_iter().for_each(|truth| line.meter.add(truth, Some(estimate)));
            if let (Some(first), Some(own)) = (first, held(record)) {
                line.overlaps += own.iou(&first);
                line.together += 1;
            }
        }
    }

    /// What there is to say at the end.
    pub fn facts(self) -> Vec<ComparedFacts> {
        let facts = |(line, target): (Line, u64)| ComparedFacts {
            target,
            tracker: line.name,
            states: line.states,
            update_ms: line.update.summary(),
            agreement: (target > 1 && line.together > 0).then(|| line.overlaps / line.together as f64),
            accuracy: line.meter.accuracy(),
        };
        self.0.into_iter().zip(1..).map(facts).collect()
    }
}
