//! Forms with a line a box.

use super::rows::Builder;
use crate::{EvaluationError, Result};
use std::io::{BufRead, Read};
use std::path::Path;

/// Bytes that a line may have.
pub(super) const MAX_LINE: u64 = 1 << 20;

/// Hands every line that is not empty to `take`, with its number from 1.
pub(crate) fn each_line(
    bytes: &mut dyn BufRead,
    path: &Path,
    mut take: impl FnMut(usize, &str) -> Result<()>,
) -> Result<()> {
    let mut line = Vec::new();
    for number in 1.. {
        line.clear();
        let mut part = Read::take(&mut *bytes, MAX_LINE + 1);
        let wrong = |reason: String| EvaluationError::dataset(path, number, reason);
        let read = part.read_until(b'\n', &mut line).map_err(|e| wrong(format!("cannot be read: {e}")))?;
        if read == 0 {
            break;
        }
        if line.len() as u64 > MAX_LINE {
            return Err(wrong("is longer than 1 MiB; this is no file of boxes".to_owned()));
        }
        let text = std::str::from_utf8(&line).map_err(|_| wrong("is no text; this is no file of boxes".to_owned()))?;
        let text = text.strip_prefix('\u{feff}').unwrap_or(text).trim();
        if !text.is_empty() {
            take(number, text)?;
        }
    }
    Ok(())
}

/// A number of a cell.
pub(crate) fn number(cell: &str, name: &str) -> Result<f64, String> {
    cell.parse::<f64>().map_err(|_| format!("{name} `{}` is not a number", cell.chars().take(40).collect::<String>()))
}

/// A number of a cell that counts something.
pub(crate) fn whole(cell: &str, name: &str, least: i64) -> Result<i64, String> {
    let value = number(cell, name)?;
    if value.fract() == 0.0 && (least as f64..=9e15).contains(&value) {
        return Ok(value as i64);
    }
    Err(format!("{name} {value} must be a whole number, {least} or more"))
}

/// Cells of a line, separated by commas, semicolons, tabs or blanks.
pub(crate) fn cells(line: &str) -> Vec<&str> {
    let separators: &[char] = if line.contains([',', ';']) { &[',', ';'] } else { &[' ', '\t'] };
    let cells = line.split(separators).map(str::trim);
    if line.contains([',', ';']) { cells.collect() } else { cells.filter(|c| !c.is_empty()).collect() }
}

const COLUMNS: [&str; 7] = ["frame", "id", "left", "top", "width", "height", "score"];

/// MOTChallenge. Of eight or nine cells the eighth is the class; of ten they are places in the world.
pub(super) fn mot(bytes: &mut dyn BufRead, builder: &mut Builder) -> Result<()> {
    let path = builder.path().to_owned();
    each_line(bytes, &path, |at, line| {
        let cells = cells(line);
        if cells.len() < 6 {
            let reason = format!("has {} cells; give frame,id,left,top,width,height,score", cells.len());
            return Err(builder.wrong(at, reason));
        }
        let read = || -> Result<_, String> {
            let frame = whole(cells[0], COLUMNS[0], 1)? as u64 - 1;
            let id = whole(cells[1], COLUMNS[1], -1)?;
            let mut ltwh = [0.0; 4];
            for (place, (cell, name)) in ltwh.iter_mut().zip(cells[2..6].iter().zip(&COLUMNS[2..6])) {
                *place = number(cell, name)?;
            }
            let score = cells.get(6).map_or(Ok(1.0), |cell| number(cell, COLUMNS[6]))?;
            let class = match cells.get(7) {
                Some(cell) if cells.len() < 10 => Some(whole(cell, "class", -1)?).filter(|class| *class >= 0),
                _ => None,
            };
            Ok((frame, u64::try_from(id).ok(), class, ltwh, score))
        };
        let (frame, id, class, ltwh, score) = read().map_err(|reason| builder.wrong(at, reason))?;
        let class = class.map(|class| builder.class(&class.to_string()));
        builder.add(Some(at), (frame, id, class), ltwh, score)
    })
}

/// KITTI tracking. Regions (`DontCare`) are no boxes.
pub(super) fn kitti(bytes: &mut dyn BufRead, builder: &mut Builder) -> Result<()> {
    let path = builder.path().to_owned();
    each_line(bytes, &path, |at, line| {
        let cells = cells(line);
        if cells.len() < 10 {
            let reason = format!(
                "has {} cells; give frame id type truncated occluded alpha left top right bottom …",
                cells.len()
            );
            return Err(builder.wrong(at, reason));
        }
        if cells[2].eq_ignore_ascii_case("dontcare") {
            return Ok(());
        }
        let read = || -> Result<_, String> {
            let (frame, id) = (whole(cells[0], "frame", 0)? as u64, whole(cells[1], "id", -1)?);
            let score = cells.get(17).map_or(Ok(1.0), |cell| number(cell, "score"))?;
            Ok((frame, u64::try_from(id).ok(), corners(&cells[6..10])?, score))
        };
        let (frame, id, ltwh, score) = read().map_err(|reason| builder.wrong(at, reason))?;
        let class = builder.class(&cells[2].to_ascii_lowercase());
        builder.add(Some(at), (frame, id, Some(class)), ltwh, score)
    })
}

/// Left, top, width, height of left, top, right, bottom.
pub(crate) fn corners(cells: &[&str]) -> Result<[f64; 4], String> {
    let mut ltrb = [0.0; 4];
    for (place, (cell, name)) in ltrb.iter_mut().zip(cells.iter().zip(["left", "top", "right", "bottom"])) {
        *place = number(cell, name)?;
    }
    let [left, top, right, bottom] = ltrb;
    Ok([left, top, right - left, bottom - top])
}
