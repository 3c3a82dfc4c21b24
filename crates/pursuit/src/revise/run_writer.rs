//! The folder of a trajectory that is put right by hand: that of a run, written as it goes.

use super::{EDITS, Revised, Row, Trajectory};
use crate::RunError;
use crate::run::RunFile;
use crate::run_folder::{self, FACTS, RunFolder};
use crate::sinks::Format;
use pursuit_address::Locator;
use pursuit_geometry::Size;
use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Writes a trajectory with what a user did to it into a folder of its own. What it has been told survives a crash: frames are added
/// as they come, whatever else changes is put in the place of the old file in one step.
pub struct RunWriter {
    folder: RunFolder,
    size: Size,
    csv: File,
    /// The frame written last.
    written: Option<u64>,
    /// The trajectory's revision that is written.
    revision: Option<u64>,
    /// What was told last, as text.
    told: [String; 2],
}

impl RunWriter {
    /// Makes a folder below `parent`, named after the input as the folders of runs are, with a number where there is one already.
    ///
    /// # Errors
    /// [`RunError::Output`] when it cannot be made.
    pub fn create(parent: &Path, input: &Locator, size: Size) -> Result<Self, RunError> {
        let folder = RunFolder::numbered(&parent.join(run_folder::name_of(input)))?;
        Self::begin(folder, size)
    }

    /// Goes on in a folder that was written so before.
    ///
    /// # Errors
    /// [`RunError::Output`] when it cannot be written, or is being written by another run.
    pub fn reopen(folder: &Path, size: Size) -> Result<Self, RunError> {
        Self::begin(RunFolder::taken(folder)?, size)
    }

    fn begin(folder: RunFolder, size: Size) -> Result<Self, RunError> {
        let path = folder.file(Format::CSV.file_name());
        let csv = File::options().append(true).create(true).open(&path).map_err(RunError::output(&path))?;
        Ok(Self { folder, size, csv, written: None, revision: None, told: Default::default() })
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Writes what has changed of the trajectory since the last call.
    ///
    /// # Errors
    /// [`RunError::Output`] when it cannot be written.
    pub fn update(&mut self, trajectory: &Trajectory) -> Result<(), RunError> {
        if self.revision == Some(trajectory.revision()) {
            let new: Vec<&Arc<Row>> = trajectory.rows().rev().take_while(|r| Some(r.frame) > self.written).collect();
            if let Some(newest) = new.first() {
                self.written = Some(newest.frame);
                let text = self.lines(new.into_iter().rev())?;
                let path = self.csv_path();
                return self.csv.write_all(&text).map_err(RunError::output(path));
            }
            return Ok(());
        }
        self.rewrite(trajectory)?;
        (self.written, self.revision) = (trajectory.last().map(|r| r.frame), Some(trajectory.revision()));
        Ok(())
    }

    /// Writes what the run is and what was done to it, where that has changed.
    ///
    /// # Errors
    /// [`RunError::Output`] when it cannot be written.
    pub fn tell(&mut self, facts: &RunFile, revised: &Revised) -> Result<(), RunError> {
        let run = facts.to_json().map_err(|e| RunError::output(self.folder.file(FACTS))(e.into()))?;
        for (at, (name, text)) in [(EDITS, revised.to_json()?), (FACTS, run)].into_iter().enumerate() {
            if self.told[at] != text {
                replace(&self.folder.file(name), text.as_bytes())?;
                self.told[at] = text;
            }
        }
        Ok(())
    }

    fn csv_path(&self) -> PathBuf {
        self.folder.file(Format::CSV.file_name())
    }

    /// The lines of these rows, without the header.
    fn lines<'a>(&self, rows: impl Iterator<Item = &'a Arc<Row>>) -> Result<Vec<u8>, RunError> {
        let whole = Format::CSV.of_rows(rows.map(|row| &**row), &[], self.size)?;
        let header = whole.iter().position(|b| *b == b'\n').map_or(whole.len(), |end| end + 1);
        Ok(whole[header..].to_vec())
    }

    fn rewrite(&mut self, trajectory: &Trajectory) -> Result<(), RunError> {
        let path = self.csv_path();
        let mut text = Format::CSV.of_rows([], &[], self.size)?;
        let first = trajectory.first().map_or(0, |row| row.frame);
        // Of a long trajectory the oldest frames are in the file alone.
        let frame_of = Format::CSV.lines()?.frame_of;
        let old = BufReader::new(File::open(&path).map_err(RunError::output(&path))?).lines();
        for line in old.map_while(Result::ok).take_while(|line| frame_of(line).is_none_or(|frame| frame < first)) {
            if frame_of(&line).is_some() {
                text.extend(line.as_bytes());
                text.push(b'\n');
            }
        }
        text.extend(self.lines(trajectory.rows())?);
        replace(&path, &text)?;
        self.csv = File::options().append(true).open(&path).map_err(RunError::output(&path))?;
        Ok(())
    }
}

/// Puts a file in the place of the one of this name, in one step.
fn replace(path: &Path, bytes: &[u8]) -> Result<(), RunError> {
    let mut part = path.as_os_str().to_owned();
    part.push(".part");
    let part = PathBuf::from(part);
    std::fs::write(&part, bytes).map_err(RunError::output(&part))?;
    std::fs::rename(&part, path).map_err(RunError::output(path))
}
