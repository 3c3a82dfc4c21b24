//! `--resume`: a run that was interrupted goes on where it was, into the same files.

use crate::RunError;
use crate::config::RunConfig;
use crate::run::{InputFacts, RecipeFacts, StateCounts};
use crate::run_folder::{FACTS, OVERLAY, STATE};
use crate::segments::Shelf;
use crate::session::Checkpoint;
use crate::sinks::{Format, Lines, can_be_added_to, read_trajectory};
use pursuit_tracking::{Estimate, TrackState};
use serde_json::Value;
use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};

/// What is left of an earlier run.
pub(crate) struct Earlier {
    folder: PathBuf,
    facts: Value,
    /// The frame looked at last.
    pub last: u64,
    /// What the targets knew after it, as saved.
    pub state: Vec<u8>,
    pub kept: Kept,
}

/// What the trajectory says up to the frame looked at last.
#[derive(Debug, Default)]
pub(crate) struct Kept {
    pub frames: u64,
    pub states: StateCounts,
    /// Of the first target, by frame.
    pub first: Vec<(u64, Option<Estimate>)>,
}

impl Earlier {
    /// The run in `folder`; `None` where nothing is left to go on from, so that it begins anew.
    ///
    /// # Errors
    /// [`RunError::Usage`] for a folder without a run, a run that is done, or formats that cannot be added to.
    pub fn find(folder: &Path, config: &RunConfig) -> Result<Option<Self>, RunError> {
        let no = |why: String| RunError::usage(format!("{} cannot be resumed: {why}", folder.display()));
        let text = std::fs::read_to_string(folder.join(FACTS)).map_err(|e| no(format!("{FACTS}: {e}")))?;
        let facts: Value = serde_json::from_str(&text).map_err(|e| no(format!("{FACTS}: {e}")))?;
        if facts["status"] == "done" {
            return Err(no("it is done".to_owned()));
        }
        for name in &config.formats {
            name.parse::<Format>()?.lines().map_err(|e| no(e.to_string()))?;
        }
        let Some((last, state)) = Checkpoint::read(&folder.join(STATE))? else {
            tracing::warn!("{}: the run was interrupted before its state was saved; it begins anew", folder.display());
            return Ok(None);
        };
        let shelf = match config.segment {
            Some(_) => Some(Shelf::reopen(folder, config.stretch(), 0.0)?),
            None => None,
        };
        let kept = match &shelf {
            Some(shelf) => Kept::read_all(&segments_of(shelf, Format::CSV), last),
            None => Kept::read_all(&[folder.join(Format::CSV.file_name())], last),
        };
        let kept = kept.map_err(|e| no(format!("its trajectory: {e}")))?;
        Ok(Some(Self { folder: folder.to_path_buf(), facts, last, state, kept }))
    }

    /// Whether it was a run of the same method on the same input.
    ///
    /// # Errors
    /// [`RunError::Usage`] naming what differs.
    pub fn check(&self, input: &InputFacts, recipe: &RecipeFacts) -> Result<(), RunError> {
        let now = serde_json::json!({ "input": input, "recipe": recipe });
        for (part, key) in [
            ("input", "name"),
            ("input", "width"),
            ("input", "height"),
            ("input", "view"),
            ("recipe", "tracker"),
            ("recipe", "parameters"),
            ("recipe", "detector"),
            ("recipe", "detector_parameters"),
            ("recipe", "acquire"),
            ("recipe", "many"),
            ("recipe", "boxes"),
            ("recipe", "compared"),
        ] {
            let (then, now) = (&self.facts[part][key], &now[part][key]);
            if !same(then, now) {
                return Err(RunError::usage(format!(
                    "{} cannot be resumed: its {part} had the {key} {then}, and now it is {now}",
                    self.folder.display()
                )));
            }
        }
        Ok(())
    }

    /// Cuts off what the newest segments say of later frames, and removes those that say nothing else.
    ///
    /// # Errors
    /// [`RunError::Output`] when a file cannot be written.
    pub fn cut_segments(&self, shelf: &Shelf, formats: &[Format]) -> Result<(), RunError> {
        for format in formats {
            let lines = format.lines()?;
            for path in segments_of(shelf, *format).iter().rev() {
                match cut(path, lines, self.last).map_err(RunError::output(path))? {
                    Left::All => break,
                    Left::Some => {}
                    Left::Nothing => shelf.drop_file(path)?,
                }
            }
        }
        Ok(())
    }

    /// Cuts off what a file says of later frames; one that is not there says nothing.
    ///
    /// # Errors
    /// [`RunError::Output`] when the file cannot be written.
    pub fn cut_file(&self, path: &Path, lines: &Lines) -> Result<(), RunError> {
        if !path.exists() {
            return Ok(());
        }
        cut(path, lines, self.last).map(drop).map_err(RunError::output(path))
    }

    /// Cuts off what text files say of later frames, and names the video of what comes: the first, `overlay-2.mp4` … that is
    /// not there yet.
    ///
    /// # Errors
    /// [`RunError::Output`] when a file cannot be written.
    pub fn cut(&self, formats: &[Format]) -> Result<PathBuf, RunError> {
        for format in formats {
            let path = self.folder.join(format.file_name());
            cut(&path, format.lines()?, self.last).map(drop).map_err(RunError::output(&path))?;
        }
        let numbered = (2_u32..).map(|n| self.folder.join(format!("overlay-{n}.mp4")));
        let mut names = std::iter::once(self.folder.join(OVERLAY)).chain(numbered);
        Ok(names.find(|path| !path.exists()).unwrap_or_else(|| self.folder.join(OVERLAY)))
    }
}

/// Numbers may have come back from text with another last digit.
fn same(a: &Value, b: &Value) -> bool {
    match (a, b) {
        (Value::Number(a), Value::Number(b)) => {
            let (a, b) = (a.as_f64().unwrap_or(f64::NAN), b.as_f64().unwrap_or(f64::NAN));
            a == b || (a - b).abs() <= 1e-12 * a.abs().max(b.abs())
        }
        (Value::Array(a), Value::Array(b)) => a.len() == b.len() && a.iter().zip(b).all(|(a, b)| same(a, b)),
        (Value::Object(a), Value::Object(b)) => {
            a.len() == b.len() && a.iter().all(|(k, a)| b.get(k).is_some_and(|b| same(a, b)))
        }
        (a, b) => a == b,
    }
}

/// The segments of a format that this run wrote, the oldest first.
fn segments_of(shelf: &Shelf, format: Format) -> Vec<PathBuf> {
    shelf.own().into_iter().filter(|w| w.stream == format.file_name()).map(|w| w.path).collect()
}

/// What is left of a file that was cut.
enum Left {
    All,
    Some,
    /// No line about a frame.
    Nothing,
}

/// Leaves whole lines up to frame `last`.
fn cut(path: &Path, lines: &Lines, last: u64) -> std::io::Result<Left> {
    let (mut kept, mut frames, mut gone) = (Vec::new(), 0, 0);
    for (number, line) in BufReader::new(File::open(path)?).split(b'\n').enumerate() {
        let line = line?;
        let is_header = number == 0 && lines.has_header;
        let is_kept = (lines.frame_of)(&String::from_utf8_lossy(&line)).is_some_and(|frame| frame <= last);
        if is_header || is_kept {
            kept.extend(line);
            kept.push(b'\n');
        }
        frames += u64::from(is_kept);
        gone += u64::from(!is_header && !is_kept);
    }
    let temporary = path.with_extension("part");
    File::create(&temporary)?.write_all(&kept)?;
    std::fs::rename(temporary, path)?;
    Ok(match (frames, gone) {
        (0, _) => Left::Nothing,
        (_, 0) => Left::All,
        _ => Left::Some,
    })
}

impl Kept {
    fn read_all(paths: &[PathBuf], last: u64) -> Result<Self, String> {
        let mut kept = Self::default();
        paths.iter().try_for_each(|path| kept.read(path, last))?;
        Ok(kept)
    }

    fn read(&mut self, path: &Path, last: u64) -> Result<(), String> {
        if !can_be_added_to(path) {
            return Err("it has the columns of another version; begin anew with --overwrite".to_owned());
        }
        let mut before = None;
        for record in read_trajectory(path)?.take_while(|record| record.frame <= last) {
            self.states.add(record.estimate.as_ref().map_or(TrackState::Lost, |estimate| estimate.state));
            if before.replace(record.frame) != Some(record.frame) {
                self.frames += 1;
                self.first.push((record.frame, record.estimate));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    #[test]
    fn files_are_cut_after_the_last_frame_and_torn_lines_go() {
        let folder = tempfile::tempdir().unwrap();
        for (format, text, wanted) in [
            ("csv", "frame,x\n0,1\n1,1\n2,1\n1", "frame,x\n0,1\n1,1\n1\n"),
            ("jsonl", "{\"frame\":1}\n{\"frame\":2}\n{\"fra", "{\"frame\":1}\n"),
            ("mot", "1,1,5\n2,1,5\n3,1,5\n", "1,1,5\n2,1,5\n"),
        ] {
            let path = folder.path().join("file");
            std::fs::write(&path, text).unwrap();
            cut(&path, format.parse::<Format>().unwrap().lines().unwrap(), 1).unwrap();
            assert_eq!(std::fs::read_to_string(&path).unwrap(), wanted, "{format}");
        }
    }

    #[test]
    fn what_was_kept_is_counted_up_to_the_last_frame() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.csv");
        let header = crate::sinks::TRAJECTORY_COLUMNS.join(",");
        let row = |frame: u32, target: u32, state: &str| {
            format!("{frame},0.5,{target},{state},1,2,3,4,0.5,,,,,5,6,7,8,1,,\n")
        };
        let rows = [
            row(0, 1, "tracking"),
            row(0, 2, "lost"),
            row(1, 1, "occluded"),
            row(1, 2, "unsure"),
            row(2, 1, "tracking"),
        ]
        .concat();
        std::fs::write(&path, format!("{header}\n{rows}")).unwrap();
        let kept = Kept::read_all(&[path], 1).unwrap();
        assert_eq!((kept.frames, kept.states), (2, StateCounts { tracking: 1, unsure: 1, occluded: 1, lost: 1 }));
        let (frame, second) = kept.first[1].clone();
        let second = second.unwrap();
        assert_eq!((frame, second.state, second.bbox.ltwh()), (1, TrackState::Occluded, (1.0, 2.0, 3.0, 4.0)));
        assert_eq!((second.prediction, second.measurement.unwrap().left()), (None, 5.0));
    }

    #[test]
    fn numbers_that_went_through_text_are_the_same() {
        let value = |text: &str| serde_json::from_str::<Value>(text).unwrap();
        assert!(same(&value("{\"a\": [1.0, 0.1]}"), &value("{\"a\": [1, 0.10000000000000002]}")));
        for (a, b) in [("1", "2"), ("[1]", "[1, 1]"), ("{\"a\": 1}", "{\"b\": 1}"), ("\"1\"", "1"), ("null", "0")] {
            assert!(!same(&value(a), &value(b)), "{a} {b}");
        }
    }
}
