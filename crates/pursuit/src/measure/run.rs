//! What a run left behind, as sightings of its targets.

use super::{MeasureOptions, Point};
use crate::sinks::{Format, read_trajectory};
use crate::{Record, RunError};
use pursuit_geometry::BBox;
use pursuit_measuring::{Sighting, Track};
use pursuit_tracking::TrackState;
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

/// A run that was read.
#[derive(Debug, Clone)]
pub struct RecordedRun {
    /// The folder that it lies in.
    pub folder: PathBuf,
    /// The trajectory that was read.
    pub trajectory: PathBuf,
    /// Its input, as it was given.
    pub input: Option<String>,
    /// Width and height of its pictures, where `run.json` says them.
    pub picture: Option<[usize; 2]>,
    targets: BTreeMap<u64, Vec<Sighting>>,
}

/// What of a line is of use.
struct Row {
    frame: u64,
    time_s: f64,
    target: u64,
    state: TrackState,
    own: Option<BBox>,
    measured: Option<BBox>,
}

impl RecordedRun {
    /// A run that is still at hand: what it said of its targets, frame after frame, on pictures of this width and height.
    pub fn of<'a>(
        records: impl IntoIterator<Item = &'a Record>,
        picture: [usize; 2],
        options: &MeasureOptions,
    ) -> Self {
        let mut targets = BTreeMap::new();
        records.into_iter().for_each(|record| take(&mut targets, options, Row::of(record)));
        Self { folder: PathBuf::new(), trajectory: PathBuf::new(), input: None, picture: Some(picture), targets }
    }

    /// Width and height of the targets' boxes where they were measured.
    pub fn boxes(&self) -> Vec<[f64; 2]> {
        self.targets.values().flatten().filter_map(|sighting| sighting.size).collect()
    }

    /// The targets' tracks; by `true_fps` where frames were taken at another rate than their times say.
    pub(super) fn tracks(&self, true_fps: Option<f64>) -> Vec<Track> {
        let at = |s: &Sighting| Sighting { time_s: true_fps.map_or(s.time_s, |fps| s.frame as f64 / fps), ..*s };
        let track = |(target, sightings): (&u64, &Vec<Sighting>)| Track {
            target: *target,
            sightings: sightings.iter().map(at).collect(),
        };
        self.targets.iter().map(track).collect()
    }
}

/// Reads a run: its folder, or a trajectory of it (`.csv`, `.jsonl`).
///
/// # Errors
/// [`RunError::Usage`] for what is no run.
pub fn read_run(path: &Path, options: &MeasureOptions) -> Result<RecordedRun, RunError> {
    let wrong = |path: &Path, why: &dyn std::fmt::Display| {
        RunError::usage(format!("{}: {why}; name the folder of a run, or its trajectory.csv", path.display()))
    };
    let trajectory = if path.is_dir() { path.join(Format::CSV.file_name()) } else { path.to_path_buf() };
    let folder = trajectory.parent().map_or_else(PathBuf::new, Path::to_path_buf);
    let mut targets = BTreeMap::<u64, Vec<Sighting>>::new();
    if trajectory.extension().is_some_and(|e| e == "jsonl") {
        read_lines(&trajectory, |row| take(&mut targets, options, row)).map_err(|e| wrong(&trajectory, &e))?;
    } else {
        let records = read_trajectory(&trajectory).map_err(|e| wrong(&trajectory, &e))?;
        records.for_each(|record| take(&mut targets, options, Row::of(&record)));
    }
    if targets.is_empty() {
        return Err(wrong(&trajectory, &"it has no rows"));
    }
    let facts = std::fs::read_to_string(folder.join("run.json")).unwrap_or_default();
    let facts: serde_json::Value = serde_json::from_str(&facts).unwrap_or_default();
    let side = |name: &str| facts["input"][name].as_u64().and_then(|side| usize::try_from(side).ok());
    let picture = side("width").zip(side("height")).map(|(w, h)| [w, h]);
    let input = facts["input"]["name"].as_str().map(str::to_owned);
    Ok(RecordedRun { folder, trajectory, input, picture, targets })
}

impl Row {
    fn of(record: &Record) -> Self {
        let said = record.estimate.as_ref();
        Self {
            frame: record.frame,
            time_s: record.time_s,
            target: record.target.0,
            state: said.map_or(TrackState::Lost, |e| e.state),
            own: said.map(|e| e.bbox),
            measured: said.and_then(|e| e.measurement),
        }
    }
}

fn take(targets: &mut BTreeMap<u64, Vec<Sighting>>, options: &MeasureOptions, row: Row) {
    let seen = targets.entry(row.target).or_default();
    let sighting = sighting(&row, options, seen.is_empty());
    seen.push(sighting);
}

/// What a line says of its target. The box that a run was started on counts as measured: it is what the user saw.
fn sighting(row: &Row, options: &MeasureOptions, first: bool) -> Sighting {
    let counts = match row.state {
        TrackState::Tracking => true,
        TrackState::Unsure => options.unsure == Some(true),
        TrackState::Occluded | TrackState::Lost => false,
    };
    let seen = row.measured.or(if first { row.own } else { None }).filter(|_| counts);
    let point = options.point.unwrap_or(Point::Center);
    Sighting {
        frame: row.frame,
        time_s: row.time_s,
        at: seen.map(|b| point.of(&b)),
        size: seen.map(|b| [b.width(), b.height()]),
    }
}

/// Reads JSON lines, up to the first that is torn.
fn read_lines(path: &Path, mut take: impl FnMut(Row)) -> Result<(), String> {
    let file = std::fs::File::open(path).map_err(|e| e.to_string())?;
    for line in BufReader::new(file).lines() {
        let line = line.map_err(|e| e.to_string())?;
        let Some(row) = serde_json::from_str(&line).ok().as_ref().and_then(row_of) else { break };
        take(row);
    }
    Ok(())
}

fn row_of(line: &serde_json::Value) -> Option<Row> {
    let bbox = |name: &str| {
        let sides: Vec<f64> = line[name].as_array()?.iter().filter_map(serde_json::Value::as_f64).collect();
        let [l, t, w, h] = sides[..] else { return None };
        Some(BBox::from_ltwh(l, t, w, h))
    };
    Some(Row {
        frame: line["frame"].as_u64()?,
        time_s: line["time_s"].as_f64()?,
        target: line["target"].as_u64()?,
        state: TrackState::from_word(line["state"].as_str()?)?,
        own: bbox("box"),
        measured: bbox("measurement"),
    })
}
