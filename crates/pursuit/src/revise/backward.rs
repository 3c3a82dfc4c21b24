//! Following backward from a box that was put right, to where the earlier track was right.

use super::{Edit, Frames, Row, Trajectory};
use crate::{Record, RunError};
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_tracking::{Estimate, Recipe, TargetId, TrackState, Tracker, Velocity};
use serde::Serialize;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

/// Two boxes that overlap by this much say the same: one half, as a score means it.
const MEETING: f64 = 0.5;

/// Why it goes no further back.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum End {
    /// Both tracks were tracking, at the same place.
    Met,
    /// The target is lost, this way too: it was hidden before, say.
    Lost,
    /// The user drew a box here that says otherwise.
    Drawn,
    /// There is no picture before this one any more.
    Gone,
    /// The user went on with something else.
    Stopped,
}

/// A row as it was.
struct Replaced {
    row: Arc<Row>,
    /// Whether the target was seen on the way back.
    seen: bool,
    /// How much more probable it is that the new box is right than that the old one was.
    gain: f64,
}

/// A tracker that is shown the frames before a corrected one, the latest first.
///
/// A tracker wants frames in order of time: time and number are mirrored at the corrected frame, and mirrored back in what
/// the tracker says.
pub struct Backward {
    target: TargetId,
    /// The frame corrected, and its time in seconds.
    from: (u64, f64),
    tracker: Box<dyn Tracker>,
    /// What was replaced, latest first.
    replaced: Vec<Replaced>,
}

impl Backward {
    /// From `bbox` in `frame`, where the target of this number is.
    ///
    /// # Errors
    /// A frame or a box on which the method cannot be started.
    pub fn new(recipe: &dyn Recipe, target: u64, frame: &Frame, bbox: BBox) -> Result<Self, RunError> {
        let tracker = recipe.init(frame, bbox)?;
        let from = (frame.index(), frame.time_s());
        Ok(Self { target: TargetId(target), from, tracker, replaced: Vec::new() })
    }

    /// The number of the target.
    pub const fn target(&self) -> u64 {
        self.target.0
    }

    /// The frame corrected.
    pub const fn from(&self) -> u64 {
        self.from.0
    }

    /// The frame reached.
    pub fn at(&self) -> u64 {
        self.replaced.last().map_or(self.from.0, |replaced| replaced.row.frame)
    }

    /// Goes a frame back and puts what is found there into the trajectory: the frame, or why there is none.
    ///
    /// # Errors
    /// An input that cannot be read again, a frame that the tracker cannot use.
    pub fn step(
        &mut self,
        frames: &mut Frames,
        trajectory: &mut Trajectory,
        edits: &[Edit],
    ) -> Result<ControlFlow<End, Arc<Frame>>, RunError> {
        let Some(row) = trajectory.before(self.at()).cloned() else { return Ok(ControlFlow::Break(End::Gone)) };
        let drawn = edits.iter().any(|e| e.frame == row.frame && e.drawn() == Some(self.target()));
        let Some(frame) = frames.get(row.frame)? else { return Ok(ControlFlow::Break(End::Gone)) };
        Ok(match self.look(&frame, &row, drawn)? {
            Ok(found) => {
                trajectory.replace(found.into());
                ControlFlow::Continue(frame)
            }
            Err(end) => ControlFlow::Break(end),
        })
    }

    /// Goes back to the end of the way: the first frame that has changed, and why it is the first.
    ///
    /// # Errors
    /// As [`step`](Self::step); what was found up to there is kept as after [`End::Gone`].
    pub fn run(
        mut self,
        frames: &mut Frames,
        trajectory: &mut Trajectory,
        edits: &[Edit],
    ) -> Result<(u64, End), RunError> {
        loop {
            match self.step(frames, trajectory, edits) {
                Ok(ControlFlow::Continue(_)) => {}
                Ok(ControlFlow::Break(end)) => return Ok((self.finish(end, trajectory), end)),
                Err(error) => {
                    self.finish(End::Gone, trajectory);
                    return Err(error);
                }
            }
        }
    }

    /// Puts back what is not sure after this end; the first frame that has changed, which is the corrected one where no
    /// other has.
    pub fn finish(self, end: End, trajectory: &mut Trajectory) -> u64 {
        let (target, mut first) = (self.target(), self.from());
        self.unsure(end).for_each(|row| trajectory.replace(row));
        while let Some(row) = trajectory.before(first).filter(|row| row.backward.contains(&target)) {
            first = row.frame;
        }
        first
    }

    /// Looks at the frame before the last one looked at, of which `row` is known: the row to put in its place, or why there
    /// is none. `drawn` says that the user drew the target's box there.
    ///
    /// # Errors
    /// A frame that the tracker cannot use.
    fn look(&mut self, frame: &Frame, row: &Arc<Row>, drawn: bool) -> Result<Result<Row, End>, RunError> {
        let known = row.records.iter().find(|r| r.target == self.target);
        let Some((known, forward)) = known.and_then(|r| Some((r, r.estimate.as_ref()?))) else {
            return Ok(Err(End::Gone));
        };
        let began = Instant::now();
        let (from, time_s) = self.from;
        let mirrored = frame.undecorated().retimed(2 * from - row.frame, 2.0 * time_s - row.time_s);
        let found = self.tracker.update(&mirrored)?;
        let both = forward.state == TrackState::Tracking && found.state == TrackState::Tracking;
        if both && forward.bbox.iou(&found.bbox) >= MEETING {
            return Ok(Err(End::Met));
        }
        if drawn {
            return Ok(Err(End::Drawn));
        }
        if found.state == TrackState::Lost {
            return Ok(Err(End::Lost));
        }
        let (seen, gain) = (found.state == TrackState::Tracking, found.score - forward.score);
        self.replaced.push(Replaced { row: row.clone(), seen, gain });
        let velocity = found.velocity.map(|v| Velocity { x: -v.x, y: -v.y });
        let estimate = Some(Estimate { time_s: row.time_s, velocity, ..found });
        let update_ms = Some(1e3 * began.elapsed().as_secs_f64());
        let record = Record { estimate, update_ms, ..known.clone() };
        let mut row = (**row).clone();
        row.put_backward(record);
        Ok(Ok(row))
    }

    /// The rows to put back after this end.
    ///
    /// Where both tracks met, none. Else what lies before the last sight of the target: what the tracker expected there is
    /// worth no more than what was there. Where the user's own box contradicts, one of the tracks went wrong on the way, and
    /// nobody knows where: the way back is kept up to where most boxes are right by their scores.
    fn unsure(self, end: End) -> impl Iterator<Item = Arc<Row>> {
        let kept = match end {
            End::Met => self.replaced.len(),
            End::Drawn => {
                let mut sum = 0.0;
                let sums = (1..).zip(&self.replaced).map(|(n, replaced)| {
                    sum += replaced.gain;
                    (if replaced.seen { n } else { 0 }, sum)
                });
                let best = sums.filter(|(n, sum)| *n > 0 && *sum > 0.0).max_by(|a, b| a.1.total_cmp(&b.1));
                best.map_or(0, |(n, _)| n)
            }
            End::Lost | End::Gone | End::Stopped => {
                self.replaced.iter().rposition(|r| r.seen).map_or(0, |last| last + 1)
            }
        };
        self.replaced.into_iter().skip(kept).map(|replaced| replaced.row)
    }
}
