use super::format::{Declared, Format, Kind, Lines};
use super::text::{Text, TextRow};
use crate::Record;
use pursuit_geometry::BBox;
use pursuit_tracking::{Estimate, TargetId, TrackState};
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// The columns of `trajectory.csv`.
pub const TRAJECTORY_COLUMNS: [&str; 18] = [
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
];

pub(super) const FORMAT: Format = Format(&Declared {
    name: "csv",
    summary: "A row for every frame and target (always written)",
    file_name: "trajectory.csv",
    media_type: "text/csv; charset=utf-8",
    kind: Kind::Text(
        |_| Box::new(Csv),
        Some(Lines { has_header: true, frame_of: |line| line.split(',').next()?.parse().ok() }),
    ),
});

/// Boxes as left, top, width, height in pixels, an empty cell where there is nothing to say.
struct Csv;

impl Text for Csv {
    fn begin(&mut self, out: &mut Vec<u8>) {
        push_row(out, &TRAJECTORY_COLUMNS);
    }

    fn add(&mut self, row: &TextRow<'_>, out: &mut Vec<u8>) {
        row.records.iter().for_each(|record| push_row(out, &cells(record)));
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
    if !columns.iter().eq(TRAJECTORY_COLUMNS) {
        return Err("it has other columns than a trajectory".to_owned());
    }
    Ok(reader.into_records().map_while(|row| record(&row.ok()?)))
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
        ..Estimate::started(time_s, own, number(8).unwrap_or_default())
    });
    let (frame, target) = (row.get(0)?.parse().ok()?, TargetId(row.get(2)?.parse().ok()?));
    Some(Record { frame, time_s, target, class: None, estimate, update_ms: number(17) })
}

fn cells(record: &Record) -> [String; TRAJECTORY_COLUMNS.len()] {
    let estimate = record.estimate.as_ref();
    let state = estimate.map_or("lost", |e| e.state.as_str());
    let [x, y, w, h] = box_cells(estimate.map(|e| e.bbox));
    let [px, py, pw, ph] = box_cells(estimate.and_then(|e| e.prediction));
    let [mx, my, mw, mh] = box_cells(estimate.and_then(|e| e.measurement));
    let score = estimate.map_or_else(String::new, |e| format!("{:.4}", e.score));
    let update_ms = record.update_ms.map_or_else(String::new, |ms| format!("{ms:.4}"));
    let (frame, time, target) = (record.frame.to_string(), format!("{:.6}", record.time_s), record.target.to_string());
    [frame, time, target, state.to_owned(), x, y, w, h, score, px, py, pw, ph, mx, my, mw, mh, update_ms]
}

fn box_cells(bbox: Option<BBox>) -> [String; 4] {
    match bbox {
        Some(b) => [b.left(), b.top(), b.width(), b.height()].map(|v| format!("{v:.3}")),
        None => Default::default(),
    }
}

/// No cell can hold a comma, a quote or a line break: numbers and state words only.
fn push_row(out: &mut Vec<u8>, cells: &[impl AsRef<str>]) {
    for (i, cell) in cells.iter().enumerate() {
        if i > 0 {
            out.push(b',');
        }
        out.extend_from_slice(cell.as_ref().as_bytes());
    }
    out.push(b'\n');
}
