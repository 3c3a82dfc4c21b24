//! YOLO's text files, one a frame: `class cx cy w h [score [id]]`, lengths in parts of the picture.

use super::lines::{cells, each_line, number, whole};
use super::rows::{Boxes, Builder};
use super::unreadable;
use crate::{EvaluationError, Result};
use pursuit_geometry::Size;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

/// Reads every `.txt` of a folder; the digits at the end of a name are the frame, counted from 0 where one is 0, else from 1.
pub(super) fn read(folder: &Path, size: Option<Size>) -> Result<Boxes> {
    let size = known(folder, size)?;
    let mut builder = Builder::new(folder);
    let entries = std::fs::read_dir(folder).map_err(|e| unreadable(folder, &e))?;
    let mut files: Vec<(u64, PathBuf)> = Vec::new();
    for entry in entries {
        let path = entry.map_err(|e| unreadable(folder, &e))?.path();
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("txt")) {
            let frame = frame_of(&path).ok_or_else(|| {
                EvaluationError::dataset(
                    &path,
                    None,
                    "its name does not end in the frame's number, as clip_12.txt does",
                )
            })?;
            files.push((frame, path));
        }
    }
    if files.is_empty() {
        return Err(EvaluationError::dataset(
            folder,
            None,
            "holds no .txt file; YOLO's form is a folder with one a frame",
        ));
    }
    files.sort();
    let from_one = files.first().is_none_or(|(frame, _)| *frame > 0);
    for (frame, path) in files {
        builder.rename(&path);
        let file = File::open(&path).map_err(|e| unreadable(&path, &e))?;
        lines(&mut BufReader::new(file), frame - u64::from(from_one), size, &mut builder)?;
    }
    Ok(builder.finish(0.0))
}

/// The size, which there has to be.
pub(super) fn known(path: &Path, size: Option<Size>) -> Result<Size> {
    let reason = "has boxes in parts of the picture; give the picture's size, for example --size 1280x720";
    size.ok_or_else(|| EvaluationError::dataset(path, None, reason))
}

/// The boxes of one frame.
pub(super) fn lines(bytes: &mut dyn BufRead, frame: u64, size: Size, builder: &mut Builder) -> Result<()> {
    let path = builder.path().to_owned();
    let (across, down) = (size.width as f64, size.height as f64);
    each_line(bytes, &path, |at, line| {
        let cells = cells(line);
        if !(5..=7).contains(&cells.len()) {
            return Err(builder.wrong(at, format!("has {} cells; give class cx cy w h [score [id]]", cells.len())));
        }
        let read = || -> Result<_, String> {
            let mut parts = [0.0; 4];
            for (place, (cell, name)) in parts.iter_mut().zip(cells[1..5].iter().zip(["cx", "cy", "w", "h"])) {
                *place = number(cell, name)?;
            }
            let [cx, cy, w, h] = parts;
            let score = cells.get(5).map_or(Ok(1.0), |cell| number(cell, "score"))?;
            let id = cells.get(6).map(|cell| whole(cell, "id", 0)).transpose()?;
            Ok(([(cx - w / 2.0) * across, (cy - h / 2.0) * down, w * across, h * down], score, id))
        };
        let (ltwh, score, id) = read().map_err(|reason| builder.wrong(at, reason))?;
        let class = builder.class(cells[0]);
        builder.add(Some(at), (frame, id.and_then(|id| u64::try_from(id).ok()), Some(class)), ltwh, score)
    })
}

/// The number at the end of a file's name.
fn frame_of(path: &Path) -> Option<u64> {
    let stem = path.file_stem()?.to_str()?;
    let digits = stem.len() - stem.trim_end_matches(|c: char| c.is_ascii_digit()).len();
    stem.get(stem.len() - digits..)?.parse().ok()
}
