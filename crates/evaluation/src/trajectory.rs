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
}

/// The first line of the file.
const HEADER: [&str; 7] = ["frame", "x", "y", "w", "h", "state", "score"];
/// Frame numbers above this are damage.
const MAX_FRAMES: usize = 10_000_000;

impl Trajectory {
    /// Nothing said about `frames` frames.
    pub fn silent(frames: usize) -> Self {
        Self { outputs: vec![None; frames] }
    }

    /// Says something about frame `index`.
    pub fn set(&mut self, index: usize, output: Output) {
        if self.outputs.len() <= index {
            self.outputs.resize(index + 1, None);
        }
        self.outputs[index] = Some(output);
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

    /// Reads a file back.
    ///
    /// # Errors
    /// A file that cannot be read, or a line that is not `frame,x,y,w,h,state,score`, named by its number.
    pub fn read(path: &Path) -> Result<Self> {
        let fail = |reason: String| EvaluationError::output(path, reason);
        let mut reader =
            csv::ReaderBuilder::new().trim(csv::Trim::All).from_path(path).map_err(|e| fail(e.to_string()))?;
        let headers = reader.headers().map_err(|e| fail(e.to_string()))?;
        if headers.iter().take(HEADER.len()).ne(HEADER) {
            return Err(fail(format!("the first line must be {}; delete the file to run again", HEADER.join(","))));
        }
        let mut trajectory = Self::default();
        for record in reader.records() {
            let record = record.map_err(|e| fail(e.to_string()))?;
            let line = record.position().map_or(0, csv::Position::line);
            let (frame, output) = parse(&record).map_err(|what| fail(format!("line {line}: {what}")))?;
            trajectory.set(frame, output);
        }
        Ok(trajectory)
    }
}

fn parse(record: &csv::StringRecord) -> Result<(usize, Output), String> {
    let cell = |i: usize| record.get(i).unwrap_or("");
    let number = |i: usize| {
        let value = cell(i).parse::<f64>().map_err(|_| format!("{} `{}` is not a number", HEADER[i], cell(i)))?;
        if value.is_finite() { Ok(value) } else { Err(format!("{} is not finite", HEADER[i])) }
    };
    let frame = cell(0).parse::<usize>().ok().filter(|f| *f < MAX_FRAMES);
    let frame = frame.ok_or_else(|| format!("frame `{}` is not a frame number", cell(0)))?;
    let state = match cell(5) {
        "tracking" => TrackState::Tracking,
        "occluded" => TrackState::Occluded,
        "lost" => TrackState::Lost,
        other => return Err(format!("state `{other}` is none of tracking, occluded, lost")),
    };
    let bbox = BBox::from_ltwh(number(1)?, number(2)?, number(3)?, number(4)?);
    Ok((frame, Output { bbox, state, score: number(6)?.clamp(0.0, 1.0) }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn some() -> Trajectory {
        let mut t = Trajectory::silent(4);
        let bbox = BBox::from_ltwh(1.25, -2.5, 30.0, 40.125);
        t.set(1, Output { bbox, state: TrackState::Tracking, score: 1.0 });
        t.set(2, Output { bbox, state: TrackState::Lost, score: 0.125 });
        t
    }

    #[test]
    fn a_trajectory_survives_its_file() {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), some().to_csv()).unwrap();
        let back = Trajectory::read(file.path()).unwrap();
        assert_eq!((back.get(1), back.get(2)), (some().get(1), some().get(2)));
        assert_eq!((back.end(), back.get(0)), (3, None));
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
