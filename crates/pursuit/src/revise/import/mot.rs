use super::Mark;
use crate::RunError;
use pursuit_geometry::BBox;
use pursuit_tracking::TrackState;

/// MOTChallenge: frame, id, left, top, width, height and confidence; frames and corners count from 1.
pub(super) fn read(text: &str) -> Result<Vec<Mark>, RunError> {
    let lines = (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty());
    lines.map(|(number, line)| mark(line).ok_or_else(|| wrong(number))).collect()
}

fn mark(line: &str) -> Option<Mark> {
    let mut cells = line.split([',', ' ', '\t']).filter(|cell| !cell.is_empty()).map(str::trim);
    let mut number = || cells.next()?.parse::<f64>().ok().filter(|v| v.is_finite());
    let [frame, target, left, top, width, height] = [number()?, number()?, number()?, number()?, number()?, number()?];
    let score = number().filter(|score| (0.0..=1.0).contains(score)).unwrap_or(1.0);
    let counts = |v: f64| (v >= 1.0 && v.fract() == 0.0 && v < 1e15).then_some(v as u64);
    (width > 0.0 && height > 0.0).then_some(())?;
    Some(Mark {
        frame: counts(frame)? - 1,
        target: counts(target)?,
        bbox: BBox::from_ltwh(left - 1.0, top - 1.0, width, height),
        state: TrackState::Tracking,
        score,
        class: None,
        key: false,
        backward: false,
    })
}

fn wrong(number: usize) -> RunError {
    RunError::usage(format!(
        "line {number} is none of MOTChallenge (frame, id, left, top, width, height …, counted from 1), and the file none of the \
         other forms that can be read: trajectory.csv, COCO with track_id, CVAT for video 1.1"
    ))
}
