//! What a user did to a trajectory, as a file beside it: `edits.json` in the folder of a run.

use super::{Edit, EditKind, Label, Row, Trajectory};
use crate::RunError;
use pursuit_geometry::BBox;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// The name of the file.
pub const EDITS: &str = "edits.json";

/// What a user did to a trajectory, and what is to be known of it beside the trajectory itself.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Revised {
    /// In order of their frames.
    pub edits: Vec<Edit>,
    /// The stretches that were followed backward: target, first and last frame.
    pub backward: Vec<(u64, u64, u64)>,
    /// What targets are called, by their numbers.
    pub labels: BTreeMap<u64, Label>,
    /// The last number that was given to a target: none is given twice.
    pub last_target: u64,
}

#[derive(Serialize, Deserialize)]
struct File {
    edits: Vec<Written>,
    #[serde(default)]
    backward: Vec<(u64, u64, u64)>,
    #[serde(default)]
    targets: BTreeMap<u64, Label>,
    #[serde(default)]
    last_target: u64,
}

/// An edit in the file; boxes are left, top, width, height in pixels.
#[derive(Serialize, Deserialize)]
struct Written {
    frame: u64,
    #[serde(flatten)]
    kind: Kind,
}

#[derive(Serialize, Deserialize)]
#[serde(tag = "what", rename_all = "lowercase")]
enum Kind {
    Add {
        target: u64,
        #[serde(rename = "box")]
        ltwh: [f64; 4],
    },
    Correct {
        target: u64,
        #[serde(rename = "box")]
        ltwh: [f64; 4],
        #[serde(default)]
        backward: bool,
    },
    Remove {
        target: u64,
    },
    Change {
        parameters: toml::Table,
    },
}

impl Revised {
    /// What is to be known of this trajectory.
    pub fn new(edits: &[Edit], trajectory: &Trajectory, labels: BTreeMap<u64, Label>, last_target: u64) -> Self {
        let backward = trajectory.current("").backward();
        Self { edits: edits.to_vec(), backward, labels, last_target }
    }

    /// The file's text.
    ///
    /// # Errors
    /// [`RunError::Usage`] for what JSON cannot hold, such as a coordinate that is no number.
    pub fn to_json(&self) -> Result<String, RunError> {
        let file = File {
            edits: self.edits.iter().map(Written::from).collect(),
            backward: self.backward.clone(),
            targets: self.labels.clone(),
            last_target: self.last_target,
        };
        let text = serde_json::to_string_pretty(&file);
        text.map(|text| text + "\n").map_err(|e| RunError::usage(format!("these edits cannot be written down: {e}")))
    }

    /// Reads the file in the folder of a run; `None` where there is none: nobody has put that run right.
    ///
    /// # Errors
    /// [`RunError::Usage`] for a file that cannot be read or holds something else.
    pub fn read(folder: &Path) -> Result<Option<Self>, RunError> {
        let wrong = |e: &dyn std::fmt::Display| RunError::usage(format!("{EDITS}: {e}"));
        let text = match std::fs::read_to_string(folder.join(EDITS)) {
            Ok(text) => text,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(e) => return Err(wrong(&e)),
        };
        let File { edits, backward, targets, last_target } = serde_json::from_str(&text).map_err(|e| wrong(&e))?;
        let mut edits: Vec<Edit> = edits.into_iter().map(Edit::from).collect();
        edits.sort_by_key(|e| e.frame);
        Ok(Some(Self { edits, backward, labels: targets, last_target }))
    }

    /// Marks in rows what was followed backward.
    pub fn mark(&self, rows: &mut [Row]) {
        for (target, first, last) in &self.backward {
            for row in rows.iter_mut().filter(|row| (*first..=*last).contains(&row.frame)) {
                if row.records.iter().any(|r| r.target.0 == *target) {
                    row.backward.push(*target);
                }
            }
        }
    }
}

fn ltwh(b: BBox) -> [f64; 4] {
    [b.left(), b.top(), b.width(), b.height()]
}

impl From<&Edit> for Written {
    fn from(edit: &Edit) -> Self {
        let kind = match &edit.kind {
            EditKind::Add { target, bbox } => Kind::Add { target: *target, ltwh: ltwh(*bbox) },
            EditKind::Correct { target, bbox, backward } => {
                Kind::Correct { target: *target, ltwh: ltwh(*bbox), backward: *backward }
            }
            EditKind::Remove { target } => Kind::Remove { target: *target },
            EditKind::Change { parameters } => Kind::Change { parameters: parameters.clone() },
        };
        Self { frame: edit.frame, kind }
    }
}

impl From<Written> for Edit {
    fn from(Written { frame, kind }: Written) -> Self {
        let bbox = |[left, top, width, height]: [f64; 4]| BBox::from_ltwh(left, top, width, height);
        let kind = match kind {
            Kind::Add { target, ltwh } => EditKind::Add { target, bbox: bbox(ltwh) },
            Kind::Correct { target, ltwh, backward } => EditKind::Correct { target, bbox: bbox(ltwh), backward },
            Kind::Remove { target } => EditKind::Remove { target },
            Kind::Change { parameters } => EditKind::Change { parameters },
        };
        Self { frame, kind }
    }
}
