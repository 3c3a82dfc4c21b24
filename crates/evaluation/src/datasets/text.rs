//! Lines of numbers, as every data set writes its truth.

use crate::{EvaluationError, Result, Truth};
use pursuit_geometry::BBox;
use std::path::Path;

/// Truth files are small; what is larger than this is no truth file.
const MAX_BYTES: u64 = 64 << 20;

/// One line of a truth file.
pub(crate) struct Line {
    /// Its number, from 1.
    pub number: usize,
    /// The numbers on it; NaN stays NaN.
    pub values: Vec<f64>,
}

/// The text of a file, whatever its encoding.
pub(crate) fn read(path: &Path) -> Result<String> {
    let unreadable = |e: std::io::Error| EvaluationError::dataset(path, None, format!("cannot be read: {e}"));
    let size = std::fs::metadata(path).map_err(unreadable)?.len();
    if size > MAX_BYTES {
        return Err(EvaluationError::dataset(path, None, format!("has {size} bytes, too many for a truth file")));
    }
    let bytes = std::fs::read(path).map_err(unreadable)?;
    let text = String::from_utf8_lossy(&bytes);
    Ok(text.strip_prefix('\u{feff}').unwrap_or(&text).to_owned())
}

/// All lines of numbers separated by commas, semicolons, tabs or blanks, each with at least `at_least` of them.
///
/// Empty lines at the end are passed over; one in between would shift every later frame and is refused.
pub(crate) fn read_numbers(path: &Path, at_least: usize) -> Result<Vec<Line>> {
    let text = read(path)?;
    let mut lines = Vec::new();
    for (number, line) in (1..).zip(text.trim_end().lines()) {
        let values = numbers_in(path, number, line)?;
        if values.len() < at_least {
            let reason = format!("has {} numbers where at least {at_least} are needed", values.len());
            return Err(EvaluationError::dataset(path, number, reason));
        }
        lines.push(Line { number, values });
    }
    Ok(lines)
}

/// The numbers of a line.
pub(super) fn numbers_in(path: &Path, number: usize, line: &str) -> Result<Vec<f64>> {
    let fields = line.split([',', ';', '\t', ' ', '\r']).map(str::trim).filter(|f| !f.is_empty());
    fields.map(|field| number_in(path, number, field)).collect()
}

/// A number; `nan` in any case is NaN, infinity is refused.
pub(super) fn number_in(path: &Path, line: usize, field: &str) -> Result<f64> {
    match field.parse::<f64>() {
        Ok(value) if !value.is_infinite() => Ok(value),
        _ if field.eq_ignore_ascii_case("-nan") => Ok(f64::NAN),
        _ => Err(EvaluationError::dataset(path, line, format!("`{}` is not a number", shortened(field)))),
    }
}

/// Truth from left, top, width, height. NaN or a box without area means that the target is away.
pub(super) fn truth_ltwh(path: &Path, line: usize, [left, top, width, height]: [f64; 4]) -> Result<Truth> {
    if [left, top, width, height].iter().any(|v| v.is_nan()) {
        return Ok(Truth::Absent);
    }
    if width < 0.0 || height < 0.0 {
        let reason = format!("width {width} and height {height} must not be negative");
        return Err(EvaluationError::dataset(path, line, reason));
    }
    let bbox = BBox::from_ltwh(left, top, width, height);
    Ok(if bbox.is_empty() { Truth::Absent } else { Truth::Visible(bbox) })
}

/// A `left,top,width,height` file, a frame a line; `origin` is the coordinate of the image's left and top edge.
pub(super) fn read_ltwh(path: &Path, origin: f64) -> Result<Vec<Truth>> {
    let truth = |line: Line| match line.values[..] {
        [left, top, width, height, ..] => truth_ltwh(path, line.number, [left - origin, top - origin, width, height]),
        _ => Ok(Truth::Unknown), // cannot be: `read_numbers` checked the length
    };
    read_numbers(path, 4)?.into_iter().map(truth).collect()
}

fn shortened(field: &str) -> String {
    field.chars().take(40).collect()
}
