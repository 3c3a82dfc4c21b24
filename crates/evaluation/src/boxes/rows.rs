//! What is read.

use super::{MAX_FRAME, MAX_ROWS};
use crate::{EvaluationError, Result};
use pursuit_geometry::BBox;
use pursuit_tracking::Class;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Coordinates above this are damage.
const MAX_COORDINATE: f64 = 1e9;

/// One box of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct BoxRow {
    /// The frame, from 0.
    pub frame: u64,
    /// Whose it is, where the file says so.
    pub id: Option<u64>,
    /// The box, as the file has it; see [`Boxes::origin`].
    pub bbox: BBox,
    /// The score, as the file has it; 1 where there is none.
    pub score: f64,
    /// What it is said to be.
    pub class: Option<Class>,
}

/// The boxes of a file, by frames; those of a frame as they stand in the file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Boxes {
    rows: Vec<BoxRow>,
    origin: f64,
}

impl Boxes {
    /// All of them, in order of frames.
    pub fn rows(&self) -> &[BoxRow] {
        &self.rows
    }

    /// The coordinate, in the file, of the picture's left and top edge: 1 in MOTChallenge's form, else 0.
    pub const fn origin(&self) -> f64 {
        self.origin
    }

    /// Those of a frame.
    pub fn of(&self, frame: u64) -> &[BoxRow] {
        let from = self.rows.partition_point(|r| r.frame < frame);
        let to = self.rows.partition_point(|r| r.frame <= frame);
        self.rows.get(from..to).unwrap_or_default()
    }

    /// One more than the last frame that has a box.
    pub fn frames(&self) -> u64 {
        self.rows.last().map_or(0, |r| r.frame + 1)
    }

    /// The same with coordinates in pixels from 0.
    #[must_use]
    pub fn in_pixels(mut self) -> Self {
        if self.origin != 0.0 {
            self.rows.iter_mut().for_each(|r| r.bbox = r.bbox.translated(-self.origin, -self.origin));
            self.origin = 0.0;
        }
        self
    }
}

/// Takes rows, checks them, and keeps one [`Class`] for each word.
pub(super) struct Builder {
    path: PathBuf,
    rows: Vec<BoxRow>,
    classes: BTreeMap<String, Class>,
}

impl Builder {
    pub fn new(path: &Path) -> Self {
        Self { path: path.to_owned(), rows: Vec::new(), classes: BTreeMap::new() }
    }

    /// What is wrong with a line.
    pub fn wrong(&self, line: impl Into<Option<usize>>, reason: impl Into<String>) -> EvaluationError {
        EvaluationError::dataset(&self.path, line, reason)
    }

    /// What errors call the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What errors call the file from here on.
    pub fn rename(&mut self, path: &Path) {
        self.path = path.to_owned();
    }

    pub fn class(&mut self, word: &str) -> Class {
        if let Some(known) = self.classes.get(word) {
            return known.clone();
        }
        self.classes.entry(word.to_owned()).or_insert_with(|| Class::from(word)).clone()
    }

    /// Adds a box: left, top, width, height.
    pub fn add(
        &mut self,
        line: Option<usize>,
        (frame, id, class): (u64, Option<u64>, Option<Class>),
        [left, top, width, height]: [f64; 4],
        score: f64,
    ) -> Result<()> {
        if self.rows.len() >= MAX_ROWS {
            return Err(self.wrong(line, format!("is the box after {MAX_ROWS}; give the sequence in parts")));
        }
        if frame > MAX_FRAME {
            return Err(self.wrong(
                line,
                format!("frame {frame} is above {MAX_FRAME}; frames are counted from the sequence's start"),
            ));
        }
        let sound = |v: f64| v.is_finite() && v.abs() <= MAX_COORDINATE;
        if ![left, top, width, height].into_iter().all(sound) || width < 0.0 || height < 0.0 {
            let reason = format!(
                "the box {left},{top},{width},{height} cannot be one; give left, top, width and height in pixels, sizes not below 0"
            );
            return Err(self.wrong(line, reason));
        }
        if !score.is_finite() {
            return Err(
                self.wrong(line, format!("the score {score} is no number; give one, 0 to 1 where it is a probability"))
            );
        }
        self.rows.push(BoxRow { frame, id, bbox: BBox::from_ltwh(left, top, width, height), score, class });
        Ok(())
    }

    /// Frames are counted from 1 where none is 0: takes one from each.
    pub fn count_from_zero(&mut self) {
        if self.rows.iter().all(|r| r.frame > 0) {
            self.rows.iter_mut().for_each(|r| r.frame -= 1);
        }
    }

    pub fn finish(mut self, origin: f64) -> Boxes {
        // Stable: what stands first in the file stays first in its frame.
        self.rows.sort_by_key(|r| r.frame);
        Boxes { rows: self.rows, origin }
    }
}
