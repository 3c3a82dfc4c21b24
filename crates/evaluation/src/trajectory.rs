//! What a tracker said about a sequence, and the file it is kept in: `boxes/TRACKER/SEQUENCE.csv`.

use crate::{EvaluationError, Result};
use pursuit_geometry::BBox;
use pursuit_tracking::{Estimate, TrackState};
use std::fmt::Write as _;
use std::path::Path;

/// What a tracker said about one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Output {
    /// The box reported.
    pub bbox: BBox,
    /// Measured, coasted or lost.
    pub state: TrackState,
    /// The probability given that the box overlaps the target by at least one half.
    pub score: f64,
}

impl From<&Estimate> for Output {
    fn from(e: &Estimate) -> Self {
        Self { bbox: e.bbox, state: e.state, score: e.score }
    }
}

/// What a tracker said about every frame; `None` where it said nothing (before its start, after an error).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trajectory {
    outputs: Vec<Option<Output>>,
    /// Whether its scores order its boxes and no more: they were never meant as probabilities.
    only_ordered: bool,
}

/// The first line of the file.
const HEADER: [&str; 7] = ["frame", "x", "y", "w", "h", "state", "score"];
/// So many of them must be there.
const NEEDED: usize = 5;
const STATE: usize = 5;
const SCORE: usize = 6;
/// Frame numbers above this are damage.
const MAX_FRAMES: usize = 10_000_000;

impl Trajectory {
    /// Nothing said about `frames` frames.
    pub fn silent(frames: usize) -> Self {
        Self { outputs: vec![None; frames], only_ordered: false }
    }

    /// The same of a program whose scores are no probabilities: they are not judged as such.
    pub(crate) fn without_probabilities(self) -> Self {
        Self { only_ordered: true, ..self }
    }

    /// Whether its scores are held to be probabilities.
    pub(crate) const fn has_probabilities(&self) -> bool {
        !self.only_ordered
    }

    /// Says something about frame `index`.
    pub fn set(&mut self, index: usize, output: Output) {
        self.put(index, Some(output));
    }

    fn put(&mut self, index: usize, output: Option<Output>) {
        if self.outputs.len() <= index {
            self.outputs.resize(index + 1, None);
        }
        self.outputs[index] = output;
    }

    /// How many frames it is about.
    pub(crate) const fn frames(&self) -> usize {
        self.outputs.len()
    }

    /// What was said about frame `index`.
    pub fn get(&self, index: usize) -> Option<&Output> {
        self.outputs.get(index).and_then(Option::as_ref)
    }

    /// One more than the last frame that something was said about.
    pub fn end(&self) -> usize {
        self.outputs.iter().rposition(Option::is_some).map_or(0, |i| i + 1)
    }

    /// The file's text: a line for every frame that something was said about.
    pub fn to_csv(&self) -> String {
        let mut text = HEADER.join(",") + "\n";
        for (frame, output) in self.outputs.iter().enumerate() {
            let Some(o) = output else { continue };
            let (x, y, w, h) = o.bbox.ltwh();
            // Four decimals of a pixel: far below what any truth is exact to.
            let _ = writeln!(text, "{frame},{x:.4},{y:.4},{w:.4},{h:.4},{},{:.6}", o.state, o.score);
        }
        text
    }

    /// Reads a file back, or a `trajectory.csv` of one target, or boxes alone: without a `state` a box is `tracking`, without a
    /// `score` it has the score 1, and none of the file's scores is held to be a probability.
    ///
    /// # Errors
    /// A file that cannot be read or lacks a column of `frame,x,y,w,h`, a line that makes no sense, named by its number, and a
    /// second target.
    pub fn read(path: &Path) -> Result<Self> {
        Self::read_counted_from(path, 0)
    }

    /// The same of a sequence that begins with frame `first` of its footage, which a `trajectory.csv` counts from.
    pub(crate) fn read_counted_from(path: &Path, first: usize) -> Result<Self> {
        let fail = |reason: String| EvaluationError::output(path, reason);
        let mut reader =
            csv::ReaderBuilder::new().trim(csv::Trim::All).from_path(path).map_err(|e| fail(e.to_string()))?;
        let headers = reader.headers().map_err(|e| fail(e.to_string()))?;
        let columns = Columns::of(headers)
            .ok_or_else(|| fail(format!("the first line must have the columns {}", HEADER[..NEEDED].join(", "))))?;
        let before = if columns.target.is_some() { first } else { 0 };
        let (mut trajectory, mut target) = (Self::default(), None);
        for record in reader.records() {
            let record = record.map_err(|e| fail(e.to_string()))?;
            let line = record.position().map_or(0, csv::Position::line);
            let wrong = |what: String| fail(format!("line {line}: {what}"));
            let own = columns.target.and_then(|at| record.get(at)).map(str::to_owned);
            if target.get_or_insert_with(|| own.clone()) != &own {
                return Err(wrong("a second target begins; a trajectory of one target can be scored".to_owned()));
            }
            let (frame, output) = columns.parse(&record).map_err(wrong)?;
            let frame =
                frame.checked_sub(before).ok_or_else(|| wrong(format!("frame {frame} is before the sequence")))?;
            trajectory.only_ordered |= output.is_some() && columns.cell(&record, SCORE).is_empty();
            trajectory.put(frame, output);
        }
        Ok(trajectory)
    }
}

/// Where the columns stand; states and scores may be nowhere.
struct Columns {
    own: [Option<usize>; HEADER.len()],
    /// Of a `trajectory.csv`.
    target: Option<usize>,
}

impl Columns {
    fn of(headers: &csv::StringRecord) -> Option<Self> {
        let at = |name: &str| headers.iter().position(|h| h == name);
        let own = HEADER.map(at);
        own[..NEEDED].iter().all(Option::is_some).then(|| Self { own, target: at("target") })
    }

    /// The cell of a column; empty where there is none.
    fn cell<'a>(&self, record: &'a csv::StringRecord, column: usize) -> &'a str {
        self.own[column].and_then(|at| record.get(at)).unwrap_or("")
    }

    /// What a line says; nothing where it has a frame and no box.
    fn parse(&self, record: &csv::StringRecord) -> Result<(usize, Option<Output>), String> {
        let cell = |i: usize| self.cell(record, i);
        let number = |i: usize| {
            let value = cell(i).parse::<f64>().map_err(|_| format!("{} `{}` is not a number", HEADER[i], cell(i)))?;
            if value.is_finite() { Ok(value) } else { Err(format!("{} is not finite", HEADER[i])) }
        };
        let frame = cell(0).parse::<usize>().ok().filter(|f| *f < MAX_FRAMES);
        let frame = frame.ok_or_else(|| format!("frame `{}` is not a frame number", cell(0)))?;
        if (1..NEEDED).all(|i| cell(i).is_empty()) {
            return Ok((frame, None));
        }
        let state = match cell(STATE) {
            "" => TrackState::Tracking,
            word => TrackState::from_word(word)
                .ok_or_else(|| format!("state `{word}` is none of tracking, unsure, occluded, lost"))?,
        };
        let score = if cell(SCORE).is_empty() { 1.0 } else { number(SCORE)?.clamp(0.0, 1.0) };
        let bbox = BBox::from_ltwh(number(1)?, number(2)?, number(3)?, number(4)?);
        Ok((frame, Some(Output { bbox, state, score })))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn some() -> Trajectory {
        let mut t = Trajectory::silent(4);
        let bbox = BBox::from_ltwh(1.25, -2.5, 30.0, 40.125);
        t.set(1, Output { bbox, state: TrackState::Tracking, score: 1.0 });
        t.set(2, Output { bbox, state: TrackState::Lost, score: 0.125 });
        t.set(3, Output { bbox, state: TrackState::Unsure, score: 0.25 });
        t
    }

    #[test]
    fn a_trajectory_survives_its_file() {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), some().to_csv()).unwrap();
        let back = Trajectory::read(file.path()).unwrap();
        assert!((1..4).all(|frame| back.get(frame).is_some() && back.get(frame) == some().get(frame)));
        assert_eq!((back.end(), back.get(0)), (4, None));
    }

    #[test]
    fn trajectories_of_track_are_read_by_column() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let header = "frame,time_s,target,state,x,y,w,h,score,pred_x\n";
        std::fs::write(file.path(), format!("{header}5,0.2,1,tracking,1,2,3,4,0.5,\n6,0.24,1,lost,,,,,,\n")).unwrap();
        let read = Trajectory::read_counted_from(file.path(), 5).unwrap();
        let bbox = BBox::from_ltwh(1.0, 2.0, 3.0, 4.0);
        assert_eq!(read.get(0), Some(&Output { bbox, state: TrackState::Tracking, score: 0.5 }));
        assert_eq!((read.end(), read.frames()), (1, 2), "a line without a box says nothing of its frame");
        assert!(Trajectory::read_counted_from(file.path(), 6).unwrap_err().to_string().contains("before the sequence"));
        std::fs::write(file.path(), format!("{header}5,0.2,1,lost,1,2,3,4,0.5,\n5,0.2,2,lost,1,2,3,4,0.5,\n")).unwrap();
        assert!(Trajectory::read(file.path()).unwrap_err().to_string().contains("line 3: a second target"));
    }

    #[test]
    fn boxes_alone_are_tracked_without_a_probability() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let read = |text: &str| {
            std::fs::write(file.path(), text).unwrap();
            Trajectory::read(file.path()).unwrap()
        };
        let bbox = BBox::from_ltwh(1.0, 2.0, 3.0, 4.0);
        let alone = read("frame,x,y,w,h\n0,1,2,3,4\n1,,,,\n2,1,2,3,4\n");
        assert_eq!(alone.get(2), Some(&Output { bbox, state: TrackState::Tracking, score: 1.0 }));
        assert!(alone.get(1).is_none() && !alone.has_probabilities());
        let scored = read("frame,x,y,w,h,score\n0,1,2,3,4,0.25\n1,1,2,3,4,0.5\n");
        assert!(scored.has_probabilities() && scored.get(0).unwrap().score == 0.25);
        assert!(!read("frame,x,y,w,h,state,score\n0,1,2,3,4,lost,0.25\n1,1,2,3,4,,\n").has_probabilities());
    }

    #[test]
    fn damaged_files_are_named_with_their_line() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let header = "frame,x,y,w,h,state,score\n";
        for (text, expected) in [
            ("frame,x\n0,1\n".to_owned(), "first line"),
            (format!("{header}0,1,2,3,4,tracking,1\n1,a,2,3,4,tracking,1\n"), "line 3: x `a`"),
            (format!("{header}0,1,2,3,4,dancing,1\n"), "line 2: state `dancing`"),
            (format!("{header}0,nan,2,3,4,lost,1\n"), "line 2: x is not finite"),
            (format!("{header}99999999999,1,2,3,4,lost,1\n"), "line 2: frame"),
            (format!("{header}0,1,2\n"), "line: 2"),
        ] {
            std::fs::write(file.path(), &text).unwrap();
            let message = Trajectory::read(file.path()).unwrap_err().to_string();
            assert!(message.contains(expected), "{text:?}: {message}");
        }
    }
}
