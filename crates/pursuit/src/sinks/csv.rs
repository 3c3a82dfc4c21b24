use super::format::{Declared, Format, Kind, Lines};
use super::text::{Text, TextRow};
use crate::Record;
use pursuit_geometry::BBox;
use pursuit_tracking::{Class, Doubt, Estimate, TargetId, TrackState};
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// The columns of `trajectory.csv`.
pub const TRAJECTORY_COLUMNS: [&str; 20] = [
    "frame",
    "time_s",
    "target",
    "state",
    "x",
    "y",
    "w",
    "h",
    "score",
    "pred_x",
    "pred_y",
    "pred_w",
    "pred_h",
    "meas_x",
    "meas_y",
    "meas_w",
    "meas_h",
    "update_ms",
    "class",
    "doubt",
];

/// Without the last of them it was written by versions that knew neither class nor doubt.
const COLUMNS_BEFORE: usize = 18;

pub(super) const FORMAT: Format = Format(&Declared {
    name: "csv",
    summary: "A row for every frame and target (always written)",
    file_name: "trajectory.csv",
    media_type: "text/csv; charset=utf-8",
    kind: Kind::Text(
        |_| Box::new(Csv(Dialect::Comma)),
        Some(Lines { has_header: true, frame_of: |line| line.split(',').next()?.parse().ok() }),
    ),
});

pub(super) const SEMICOLON: Format = Format(&Declared {
    name: "csv-semicolon",
    summary: "The CSV with semicolons between and commas in numbers, as spreadsheets of half Europe want it",
    file_name: "trajectory-semicolon.csv",
    media_type: "text/csv; charset=utf-8",
    kind: Kind::Text(
        |_| Box::new(Csv(Dialect::Semicolon)),
        Some(Lines { has_header: true, frame_of: |line| line.split(';').next()?.parse().ok() }),
    ),
});

/// What stands between cells and within numbers.
#[derive(Clone, Copy, PartialEq)]
enum Dialect {
    Comma,
    Semicolon,
}

/// Boxes as left, top, width, height in pixels, an empty cell where there is nothing to say.
struct Csv(Dialect);

impl Text for Csv {
    fn begin(&mut self, out: &mut Vec<u8>) {
        self.0.push_row(out, TRAJECTORY_COLUMNS.map(str::to_owned));
    }

    fn add(&mut self, row: &TextRow<'_>, out: &mut Vec<u8>) {
        row.records.iter().for_each(|record| self.0.push_row(out, cells(record)));
    }
}

impl Dialect {
    fn push_row(self, out: &mut Vec<u8>, cells: [String; TRAJECTORY_COLUMNS.len()]) {
        for (i, cell) in cells.into_iter().enumerate() {
            if i > 0 {
                out.push(if self == Self::Comma { b',' } else { b';' });
            }
            let cell = match self {
                Self::Semicolon if cell.parse::<f64>().is_ok() => cell.replace('.', ","),
                _ => quoted(cell),
            };
            out.extend_from_slice(cell.as_bytes());
        }
        out.push(b'\n');
    }
}

/// What a `trajectory.csv` holds, up to the first line that is torn: to three decimals, and without what it does not write.
///
/// # Errors
/// A file that cannot be read or has other columns, in words.
pub fn read_trajectory(path: &Path) -> Result<impl Iterator<Item = Record>, String> {
    parse_trajectory(File::open(path).map_err(|e| e.to_string())?)
}

/// The same of anything that can be read.
///
/// # Errors
/// As [`read_trajectory`].
pub fn parse_trajectory<R: Read>(text: R) -> Result<impl Iterator<Item = Record> + use<R>, String> {
    let mut reader = csv::Reader::from_reader(text);
    let columns = reader.headers().map_err(|e| e.to_string())?;
    let known = columns.len() == TRAJECTORY_COLUMNS.len() || columns.len() == COLUMNS_BEFORE;
    if !known || columns.iter().zip(TRAJECTORY_COLUMNS).any(|(theirs, ours)| theirs != ours) {
        return Err("it has other columns than a trajectory".to_owned());
    }
    Ok(reader.into_records().map_while(|row| record(&row.ok()?)))
}

/// Whether rows can be added to the file as they are written now.
pub(crate) fn can_be_added_to(path: &Path) -> bool {
    let columns = csv::Reader::from_path(path).and_then(|mut reader| reader.headers().cloned());
    columns.is_ok_and(|columns| columns.iter().eq(TRAJECTORY_COLUMNS))
}

fn record(row: &csv::StringRecord) -> Option<Record> {
    let number = |column: usize| row.get(column)?.parse::<f64>().ok().filter(|v| v.is_finite());
    let bbox = |at: usize| Some(BBox::from_ltwh(number(at)?, number(at + 1)?, number(at + 2)?, number(at + 3)?));
    let time_s = number(1)?;
    let state = TrackState::from_word(row.get(3)?)?;
    let estimate = bbox(4).map(|own| Estimate {
        state,
        prediction: bbox(9),
        measurement: bbox(13),
        doubt: row.get(19).and_then(Doubt::from_word),
        ..Estimate::started(time_s, own, number(8).unwrap_or_default())
    });
    let (frame, target) = (row.get(0)?.parse().ok()?, TargetId(row.get(2)?.parse().ok()?));
    let class = row.get(18).filter(|word| !word.is_empty()).map(Class::from);
    Some(Record { frame, time_s, target, class, estimate, update_ms: number(17) })
}

/// The cells of a row, as [`TRAJECTORY_COLUMNS`] names them.
pub(super) fn cells(record: &Record) -> [String; TRAJECTORY_COLUMNS.len()] {
    let estimate = record.estimate.as_ref();
    let state = estimate.map_or("lost", |e| e.state.as_str());
    let [x, y, w, h] = box_cells(estimate.map(|e| e.bbox));
    let [px, py, pw, ph] = box_cells(estimate.and_then(|e| e.prediction));
    let [mx, my, mw, mh] = box_cells(estimate.and_then(|e| e.measurement));
    let score = estimate.map_or_else(String::new, |e| format!("{:.4}", e.score));
    let update_ms = record.update_ms.map_or_else(String::new, |ms| format!("{ms:.4}"));
    let (frame, time, target) = (record.frame.to_string(), format!("{:.6}", record.time_s), record.target.to_string());
    let class = record.class.as_ref().map_or_else(String::new, |class| class.as_str().to_owned());
    let doubt = estimate.and_then(|e| e.doubt).map_or_else(String::new, |doubt| doubt.as_str().to_owned());
    let state = state.to_owned();
    [frame, time, target, state, x, y, w, h, score, px, py, pw, ph, mx, my, mw, mh, update_ms, class, doubt]
}

fn box_cells(bbox: Option<BBox>) -> [String; 4] {
    match bbox {
        Some(b) => [b.left(), b.top(), b.width(), b.height()].map(|v| format!("{v:.3}")),
        None => Default::default(),
    }
}

/// A cell of any text; a line break would tear the row for whoever counts lines.
fn quoted(text: String) -> String {
    if !text.contains([',', ';', '"', '\n', '\r']) {
        return text;
    }
    format!("\"{}\"", text.replace(['\n', '\r'], " ").replace('"', "\"\""))
}
