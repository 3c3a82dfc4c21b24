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

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::sinks::Format;
    use pursuit_geometry::Size;

    fn info() -> SourceInfo {
        SourceInfo { fps: Some(25.0), frame_count: Some(12), ..SourceInfo::new("clip", Size::new(64, 48), "test") }
    }

    /// Two targets: the first from frame 2 on and put right in frame 5, the second in three frames, hidden in one.
    fn drawn() -> (Vec<Row>, Vec<Edit>) {
        let mut rows: Vec<Row> = (0..8)
            .map(|frame| Row { frame, time_s: frame as f64 / 25.0, records: Vec::new(), backward: Vec::new() })
            .collect();
        let own = |frame: u64| BBox::from_ltwh(3.0 + frame as f64, 4.5, 10.0, 8.25);
        for row in &mut rows[2..] {
            row.put(1, own(row.frame), 0.1);
        }
        for row in &mut rows[4..7] {
            row.put(3, BBox::from_ltwh(30.0, 20.0, 5.0, 6.0), 0.1);
        }
        rows[4].backward = vec![1];
        let hidden = rows[5].records.iter_mut().find(|r| r.target.0 == 3).unwrap().estimate.as_mut().unwrap();
        (hidden.state, hidden.measurement) = (TrackState::Occluded, None);
        let edits = vec![
            Edit { frame: 2, kind: EditKind::Add { target: 1, bbox: own(2) } },
            Edit { frame: 4, kind: EditKind::Add { target: 3, bbox: BBox::from_ltwh(30.0, 20.0, 5.0, 6.0) } },
            Edit { frame: 5, kind: EditKind::Correct { target: 1, bbox: own(5), backward: false } },
        ];
        (rows, edits)
    }

    fn boxes(rows: &[Row]) -> Vec<(u64, u64, BBox, TrackState)> {
        let all = rows.iter().flat_map(|row| row.records.iter().map(move |r| (row.frame, r)));
        all.map(|(frame, r)| (frame, r.target.0, r.estimate.as_ref().unwrap().bbox, r.estimate.as_ref().unwrap().state))
            .collect()
    }

    #[test]
    fn what_was_exported_is_read_back() {
        let (rows, edits) = drawn();
        for (name, keeps_hidden, keeps_corrections) in
            [("csv", true, false), ("mot", false, false), ("coco", true, false), ("cvat", true, true)]
        {
            let format: Format = name.parse().unwrap();
            let text = format.of_rows(&rows, &edits, info().size).unwrap();
            let read = Imported::read(&text, &info()).unwrap_or_else(|e| panic!("{name}: {e}"));
            let wanted: Vec<_> =
                boxes(&rows).into_iter().filter(|b| keeps_hidden || b.3 == TrackState::Tracking).collect();
            assert_eq!(boxes(&read.rows), wanted, "{name}");
            assert_eq!(read.rows.iter().map(|r| r.frame).collect::<Vec<_>>(), (0..8).collect::<Vec<_>>(), "{name}");
            let wanted = if keeps_corrections { &edits[..] } else { &edits[..2] };
            assert_eq!(read.edits, wanted, "{name}");
            assert_eq!(read.rows[4].backward, if name == "coco" { vec![1] } else { vec![] }, "{name}");
        }
    }

    #[test]
    fn key_frames_of_other_programs_are_joined() {
        let text = r#"<?xml version="1.0"?><annotations><version>1.1</version><meta><task/></meta>
            <track id="4" label="bee &amp; co"><box frame="2" outside="0" occluded="0" keyframe="1" xtl="0" ytl="0" xbr="10" ybr="10"/>
            <box frame="6" outside="0" occluded="1" keyframe="1" xtl="8" ytl="4" xbr="22" ybr="14"><attribute name="x">1</attribute></box>
            <box frame="7" outside="1" occluded="0" keyframe="1" xtl="8" ytl="4" xbr="22" ybr="14"/></track></annotations>"#;
        let read = Imported::read(text.as_bytes(), &info()).unwrap();
        let own: Vec<_> = boxes(&read.rows).into_iter().map(|(frame, _, bbox, _)| (frame, bbox)).collect();
        assert_eq!(own[1], (3, BBox::from_ltwh(2.0, 1.0, 11.0, 10.0)));
        assert_eq!((own.len(), read.edits.len(), read.rows[2].records[0].target.0), (6, 2, 5));
        assert_eq!(read.rows[2].records[0].class.as_ref().unwrap().as_str(), "bee & co");
    }

    #[test]
    fn what_is_none_of_them_is_said() {
        for (text, says) in [
            ("", "says nothing"),
            ("hello", "line 1"),
            ("1,2,3\n", "line 1"),
            ("{\"images\": 3}", "COCO"),
            ("{\"images\": [], \"annotations\": [{\"id\": 1, \"image_id\": 1, \"bbox\": [1,2,3,4]}]}", "track_id"),
            ("<annotations><image/></annotations>", "says nothing"),
            ("<annotations><track id=\"x\">", "CVAT"),
            ("13,1,1,1,5,5,1,-1,-1,-1\n", "beyond the end"),
            ("1,1,1,1,-5,5,1,-1,-1,-1\n", "line 1"),
        ] {
            let error = Imported::read(text.as_bytes(), &info()).err().map(|e| e.to_string()).unwrap_or_default();
            assert!(error.contains(says), "{text}: {error:?}");
        }
        assert!(Imported::read(&[0xff, 0xfe, 0], &info()).is_err());
    }
}
