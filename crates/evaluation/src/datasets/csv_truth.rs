//! The project's own layouts: a folder with `frames.csv`, and a video `NAME.mp4` with `NAME.csv`. Boxes are taken as
//! they are: left, top, width, height; `nan` means that the target is away, an empty cell that nobody says.

use super::text::{number_in, read, truth_ltwh};
use crate::{EvaluationError, Footage, Result, Sequence, Truth};
use std::path::{Path, PathBuf};

/// Frames that a gap in the index column may skip; more is a damaged file.
const MAX_FRAMES: usize = 10_000_000;

/// A folder's `frames.csv`: one row is one frame, in file order.
pub(super) fn read_frames_csv(folder: &Path, name: String) -> Result<Sequence> {
    let path = folder.join("frames.csv");
    let rows = read_rows(&path)?;
    let image = |row: &Row| {
        let reason = "names no image; the columns are index,image,x,y,w,h";
        let image = row.image.as_ref().map(|i| folder.join(i));
        image.ok_or_else(|| EvaluationError::dataset(&path, row.line, reason))
    };
    let images: Vec<PathBuf> = rows.iter().map(image).collect::<Result<_>>()?;
    Ok(Sequence::new(name, Footage::Images(images), rows.into_iter().map(|r| r.truth).collect()))
}

/// Truth of a video: rows are frames in order, unless the index column skips some, which are then unknown.
pub(super) fn read_video_csv(path: &Path) -> Result<Vec<Truth>> {
    let rows = read_rows(path)?;
    let indices: Option<Vec<usize>> = rows.iter().map(|row| row.index).collect();
    let in_order = || rows.iter().map(|row| row.truth).collect();
    let Some(indices) = indices.filter(|all| all.is_sorted_by(|a, b| a < b)) else {
        return Ok(in_order());
    };
    let first = indices.first().copied().unwrap_or(0);
    let last = indices.last().copied().unwrap_or(0);
    let has_gaps = last - first + 1 != indices.len().max(1);
    if !has_gaps {
        return Ok(in_order());
    }
    if last > MAX_FRAMES {
        return Err(EvaluationError::dataset(path, None, format!("frame number {last} is out of all proportion")));
    }
    let mut truth = vec![Truth::Unknown; last + 1];
    for (index, row) in indices.into_iter().zip(rows) {
        truth[index] = row.truth;
    }
    Ok(truth)
}

struct Row {
    line: usize,
    index: Option<usize>,
    image: Option<String>,
    truth: Truth,
}

fn read_rows(path: &Path) -> Result<Vec<Row>> {
    let text = read(path)?;
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text.as_bytes());
    let headers = reader.headers().map_err(|e| broken(path, &e))?.clone();
    let column = |name: &str| headers.iter().position(|h| h.eq_ignore_ascii_case(name));
    let needed = |name: &str| {
        let reason = || format!("has no column `{name}`; the first line must name index,…,x,y,w,h");
        column(name).ok_or_else(|| EvaluationError::dataset(path, 1, reason()))
    };
    let boxes = [needed("x")?, needed("y")?, needed("w")?, needed("h")?];
    let (index, image) = (column("index"), column("image"));
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|e| broken(path, &e))?;
        let line = record.position().map_or(0, |p| p.line() as usize);
        let number = index.and_then(|i| record.get(i)).and_then(|field| field.parse().ok());
        let image = image.and_then(|i| record.get(i)).filter(|i| !i.is_empty()).map(str::to_owned);
        let truth = truth_of(path, line, boxes.map(|c| record.get(c).unwrap_or("")))?;
        rows.push(Row { line, index: number, image, truth });
    }
    Ok(rows)
}

fn truth_of(path: &Path, line: usize, fields: [&str; 4]) -> Result<Truth> {
    if fields.iter().any(|f| f.is_empty()) {
        return Ok(Truth::Unknown);
    }
    let mut values = [0.0; 4];
    for (value, field) in values.iter_mut().zip(fields) {
        *value = number_in(path, line, field)?;
    }
    truth_ltwh(path, line, values)
}

fn broken(path: &Path, error: &csv::Error) -> EvaluationError {
    EvaluationError::dataset(path, error.position().map(|p| p.line() as usize), error.to_string())
}
