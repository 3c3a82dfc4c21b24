//! Trajectories and annotations of other programs, and our own exports, read back.

mod coco;
mod cvat;
mod mot;

use super::{Edit, EditKind, Label, Row};
use crate::sinks::{TRAJECTORY_COLUMNS, parse_trajectory};
use crate::{Record, RunError};
use pursuit_geometry::BBox;
use pursuit_media::SourceInfo;
use pursuit_tracking::{Class, Estimate, TargetId, TrackState};
use std::collections::{BTreeMap, BTreeSet};

/// Where frames carry no times and the input has no rate, this one is taken.
const DEFAULT_FPS: f64 = 25.0;
/// Frames that one file may be about.
const MOST_FRAMES: u64 = 10_000_000;

/// What a file says of an input.
#[derive(Debug, Clone, Default)]
pub struct Imported {
    /// A row for every frame up to the last that the file says something of.
    pub rows: Vec<Row>,
    /// What a user would have done: a target added in its first frame, and put right in every key frame.
    pub edits: Vec<Edit>,
    /// What the targets are called in the file, where they have names.
    pub labels: BTreeMap<u64, Label>,
}

/// One box of a file.
#[derive(Debug, Clone, PartialEq)]
struct Mark {
    frame: u64,
    target: u64,
    bbox: BBox,
    state: TrackState,
    score: f64,
    class: Option<String>,
    /// Whether a person drew it.
    key: bool,
    backward: bool,
}

impl Imported {
    /// Reads the text of a file in the form of our own CSV, MOTChallenge, COCO with `track_id`, or CVAT for video 1.1; which of them
    /// it is is seen by its content. Frames and times are those of `info`'s input.
    ///
    /// # Errors
    /// [`RunError::Usage`] for a file of another form, frames beyond the end of the input, and a file that says nothing.
    pub fn read(text: &[u8], info: &SourceInfo) -> Result<Self, RunError> {
        let text = std::str::from_utf8(text).map_err(|_| unknown())?.trim_start_matches('\u{feff}');
        let start = text.trim_start();
        let imported = if start.starts_with(&TRAJECTORY_COLUMNS[..3].join(",")) {
            let records = parse_trajectory(text.as_bytes()).map_err(|e| RunError::usage(format!("CSV: {e}")))?;
            Self::from_records(records.collect(), info)?
        } else if start.starts_with('{') {
            Self::from_marks(coco::read(text)?, info)?
        } else if start.starts_with('<') {
            Self::from_marks(cvat::read(text)?, info)?
        } else {
            Self::from_marks(mot::read(text)?, info)?
        };
        if imported.edits.is_empty() {
            Err(RunError::usage("this file says nothing of any target"))
        } else {
            Ok(imported)
        }
    }

    fn from_marks(marks: Vec<Mark>, info: &SourceInfo) -> Result<Self, RunError> {
        let keys: BTreeSet<(u64, u64)> = marks.iter().filter(|m| m.key).map(|m| (m.frame, m.target)).collect();
        let backward: BTreeSet<(u64, u64)> = marks.iter().filter(|m| m.backward).map(|m| (m.frame, m.target)).collect();
        let fps = info.fps.unwrap_or(DEFAULT_FPS);
        let record = |mark: Mark| {
            let time_s = mark.frame as f64 / fps;
            let measured = matches!(mark.state, TrackState::Tracking | TrackState::Unsure);
            let started = Estimate::started(time_s, mark.bbox, mark.score);
            let measurement = started.measurement.filter(|_| measured);
            Record {
                frame: mark.frame,
                time_s,
                target: TargetId(mark.target),
                class: mark.class.map(Class::from),
                estimate: Some(Estimate { state: mark.state, measurement, ..started }),
                update_ms: None,
            }
        };
        let mut imported = Self::from_records(marks.into_iter().map(record).collect(), info)?;
        for row in &mut imported.rows {
            let there = row.records.iter().map(|r| r.target.0);
            row.backward = there.filter(|target| backward.contains(&(row.frame, *target))).collect();
            for record in &row.records {
                let Some(estimate) = &record.estimate else { continue };
                let begun = imported.edits.iter().any(|e| e.frame == row.frame && e.drawn() == Some(record.target.0));
                if keys.contains(&(row.frame, record.target.0)) && !begun {
                    let kind = EditKind::Correct { target: record.target.0, bbox: estimate.bbox, backward: false };
                    imported.edits.push(Edit { frame: row.frame, kind });
                }
            }
        }
        imported.edits.sort_by_key(|e| e.frame);
        Ok(imported)
    }

    fn from_records(mut records: Vec<Record>, info: &SourceInfo) -> Result<Self, RunError> {
        records.sort_by_key(|r| (r.frame, r.target));
        records.dedup_by_key(|r| (r.frame, r.target));
        let last = records.last().map_or(0, |r| r.frame);
        if let Some(count) = info.frame_count.filter(|count| last >= *count) {
            return Err(RunError::usage(format!(
                "frame {last} of this file is beyond the end of {}, which has {count} frames; is it of another clip?",
                info.name
            )));
        }
        if last >= MOST_FRAMES {
            return Err(RunError::usage(format!("frame {last} is more than a clip has")));
        }
        let mut edits: Vec<Edit> = Vec::new();
        let mut begun = BTreeSet::new();
        for record in &records {
            let target = record.target.0;
            if let Some(estimate) = record.estimate.as_ref().filter(|e| e.state != TrackState::Lost)
                && begun.insert(target)
            {
                edits.push(Edit { frame: record.frame, kind: EditKind::Add { target, bbox: estimate.bbox } });
            }
        }
        let mut rows: Vec<Row> = Vec::new();
        for record in records {
            match rows.last_mut().filter(|row| row.frame == record.frame) {
                Some(row) => row.records.push(record),
                None => rows.push(Row {
                    frame: record.frame,
                    time_s: record.time_s,
                    records: vec![record],
                    backward: Vec::new(),
                }),
            }
        }
        Ok(Self { rows: complete(rows, info.fps), edits, labels: BTreeMap::new() })
    }
}

/// With an empty row for every frame up to the last that has none: so each can be gone to.
pub fn complete(rows: Vec<Row>, fps: Option<f64>) -> Vec<Row> {
    let step_s = 1.0 / fps.unwrap_or(DEFAULT_FPS);
    let mut all: Vec<Row> = Vec::with_capacity(rows.len());
    for row in rows {
        let next = all.last().map_or(0, |last| last.frame + 1);
        for frame in next..row.frame {
            let time_s = (row.time_s - (row.frame - frame) as f64 * step_s).max(0.0);
            all.push(Row { frame, time_s, records: Vec::new(), backward: Vec::new() });
        }
        all.push(row);
    }
    all
}

fn unknown() -> RunError {
    RunError::usage(
        "this file is none of the forms that can be read: trajectory.csv, MOTChallenge, COCO with track_id, CVAT for video 1.1",
    )
}
