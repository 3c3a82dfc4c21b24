//! Result files of other programs, a frame a line: those of OTB and its followers (`SEQUENCE.txt`), of GOT-10k and of VOT
//! (`SEQUENCE/SEQUENCE_001.txt`, a file for each repetition).
//!
//! Boxes are left,top,width,height in the convention of the data set's own truth, or polygons, whose bounds are taken. A
//! line of one number is VOT's code: 1 the tracker was started, 2 it failed, 0 nothing is said. Nothing is said either by a
//! box with NaN or without area. Beside `STEM.txt`, `STEM_confidence.value` may hold a confidence a line (VOT), and
//! `SEQUENCE_time.txt` the seconds of each frame (GOT-10k, VOT).

use crate::datasets::text::{self, Line, read_numbers};
use crate::datasets::{bounds, natural_order};
use crate::{EvaluationError, Output, Protocol, Result, Sequence, Trajectory, UpdateTime};
use pursuit_geometry::BBox;
use pursuit_tracking::TrackState;
use std::path::{Path, PathBuf};

/// What one file says.
pub(crate) struct Said {
    pub trajectory: Trajectory,
    /// Frames on which the tracker was started.
    pub starts: Vec<usize>,
    /// Frames in which it failed.
    pub failures: Vec<usize>,
    /// As the other program measured it.
    pub update: Option<UpdateTime>,
}

/// The files below `root` that are about the sequence of that name, one for each repetition, in order; none where there
/// are none. `root` may be the one file where the sequence is `alone`.
pub(crate) fn find(root: &Path, sequence: &str, alone: bool) -> Vec<PathBuf> {
    let last = sequence.rsplit('/').next().unwrap_or(sequence);
    if alone && root.is_file() {
        return vec![root.to_owned()];
    }
    for name in [sequence, last] {
        let file = root.join(format!("{name}.txt"));
        if file.is_file() {
            return vec![file];
        }
        let mut repetitions = numbered(&root.join(name), last);
        if alone && repetitions.is_empty() {
            repetitions = numbered(root, last);
        }
        if !repetitions.is_empty() {
            return repetitions;
        }
    }
    Vec::new()
}

/// `NAME_001.txt`, `NAME_002.txt` … in `folder`.
fn numbered(folder: &Path, name: &str) -> Vec<PathBuf> {
    let is_repetition = |file: &str| {
        let number = file.strip_suffix(".txt").and_then(|f| f.strip_prefix(name)).and_then(|f| f.strip_prefix('_'));
        number.is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()))
    };
    let entries = std::fs::read_dir(folder).into_iter().flatten().filter_map(std::result::Result::ok);
    let mut names: Vec<String> =
        entries.filter_map(|e| e.file_name().into_string().ok()).filter(|n| is_repetition(n)).collect();
    names.sort_by(|a, b| natural_order(a, b));
    names.into_iter().map(|n| folder.join(n)).collect()
}

/// Reads one file.
///
/// # Errors
/// A file that cannot be read, a line that is no box, a length other than the sequence's, and one of another experiment
/// than `protocol`: VOT's supervised one marks starts and failures.
pub(crate) fn read(file: &Path, sequence: &Sequence, protocol: Protocol) -> Result<Said> {
    let fail = |line: Option<usize>, reason: String| EvaluationError::dataset(file, line, reason);
    let is_mask = |line: &str| line.trim_start().starts_with(['m', 'M']);
    if let Some(line) = text::read(file)?.lines().position(is_mask) {
        return Err(fail(Some(line + 1), "is a mask; rectangles and polygons can be scored".to_owned()));
    }
    let lines = read_numbers(file, 1)?;
    let (frames, name) = (sequence.truth().len(), sequence.name());
    if lines.len() != frames {
        return Err(fail(None, format!("has {} lines for {frames} frames of {name}", lines.len())));
    }
    let confidences = Confidences::beside(file)?;
    let (mut trajectory, mut starts, mut failures) = (Trajectory::silent(frames), Vec::new(), Vec::new());
    for (i, line) in lines.iter().enumerate() {
        let said = parse(line, sequence.origin()).map_err(|reason| fail(Some(line.number), reason))?;
        let (bbox, score) = match said {
            Entry::Box(bbox) => (bbox, confidences.at(i)),
            Entry::Failed => {
                failures.push(i);
                continue;
            }
            Entry::Started => {
                starts.push(i);
                match sequence.truth().get(i).and_then(|t| t.bbox()) {
                    Some(truth) => (truth, 1.0),
                    None => continue,
                }
            }
            Entry::Nothing => continue,
        };
        trajectory.set(i, Output { bbox, state: TrackState::Tracking, score });
    }
    match protocol {
        Protocol::Reset if starts.is_empty() => {
            let reason = "marks no start; files of VOT's supervised experiment have 1 in the frames in which the tracker is \
                          started, 2 where it failed and 0 where it was not run";
            return Err(fail(None, reason.to_owned()));
        }
        Protocol::Reset => {}
        _ => {
            if let Some(failure) = failures.first() {
                let reason = "marks a failure, as VOT's supervised experiment does; score it with the protocol `reset`";
                return Err(fail(Some(failure + 1), reason.to_owned()));
            }
        }
    }
    if !confidences.are_probabilities {
        trajectory = trajectory.without_probabilities();
    }
    Ok(Said { trajectory, starts, failures, update: time_beside(file, sequence.name())? })
}

/// What a line says.
enum Entry {
    Box(BBox),
    Started,
    Failed,
    Nothing,
}

fn parse(line: &Line, origin: f64) -> Result<Entry, String> {
    let bbox = match line.values[..] {
        [0.0] => return Ok(Entry::Nothing),
        [1.0] => return Ok(Entry::Started),
        [2.0] => return Ok(Entry::Failed),
        [code] if code.is_nan() => return Ok(Entry::Nothing),
        [code] => return Err(format!("{code} is no code; there are 0 nothing said, 1 started and 2 failed")),
        [left, top, width, height] => {
            let says = [left, top, width, height].iter().all(|v| v.is_finite()) && width > 0.0 && height > 0.0;
            says.then(|| BBox::from_ltwh(left - origin, top - origin, width, height))
        }
        _ if line.values.len() >= 6 && line.values.len().is_multiple_of(2) => {
            bounds(&line.values).map(|b| b.translated(-origin, -origin))
        }
        _ => return Err(format!("has {} numbers; a box has 4, a polygon 6, 8 or more", line.values.len())),
    };
    Ok(bbox.filter(|b| b.is_finite() && !b.is_empty()).map_or(Entry::Nothing, Entry::Box))
}

/// Confidences as scores in [0, 1].
struct Confidences {
    values: Vec<f64>,
    /// Whether they lie in [0, 1] as they are, so that they can be held to be probabilities.
    are_probabilities: bool,
}

impl Confidences {
    /// Of `STEM_confidence.value` beside `STEM.txt`; none where there is no such file.
    fn beside(file: &Path) -> Result<Self> {
        let stem = file.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
        let path = file.with_file_name(format!("{stem}_confidence.value"));
        if !path.is_file() {
            return Ok(Self { values: Vec::new(), are_probabilities: false });
        }
        // The first line, of the start, is empty.
        let values: Vec<f64> =
            read_numbers(&path, 0)?.iter().map(|l| l.values.first().copied().unwrap_or(f64::NAN)).collect();
        let known = || values.iter().copied().filter(|v| v.is_finite());
        let (low, high) = (known().fold(f64::INFINITY, f64::min), known().fold(f64::NEG_INFINITY, f64::max));
        let are_probabilities = low.is_finite() && low >= 0.0 && high <= 1.0;
        // Any rising scale leaves the order, which the long-term figures go by.
        let scaled = |v: f64| if are_probabilities { v } else { (v - low) / (high - low).max(f64::MIN_POSITIVE) };
        Ok(Self { values: values.iter().map(|v| scaled(*v).clamp(0.0, 1.0)).collect(), are_probabilities })
    }

    /// Of frame `i`; 1 where nothing is said.
    fn at(&self, i: usize) -> f64 {
        self.values.get(i).copied().filter(|v| v.is_finite()).unwrap_or(1.0)
    }
}

/// Of `SEQUENCE_time.txt` beside the file: seconds a line, the first of which is of the start.
fn time_beside(file: &Path, sequence: &str) -> Result<Option<UpdateTime>> {
    let last = sequence.rsplit('/').next().unwrap_or(sequence);
    let path = file.with_file_name(format!("{last}_time.txt"));
    if !path.is_file() {
        return Ok(None);
    }
    let seconds = read_numbers(&path, 0)?.into_iter().filter_map(|l| l.values.first().copied()).skip(1);
    let wall_ms: Vec<f64> = seconds.filter(|s| s.is_finite() && *s > 0.0).map(|s| s * 1e3).collect();
    Ok(UpdateTime::of(&wall_ms, wall_ms.iter().sum()))
}
