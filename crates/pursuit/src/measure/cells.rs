//! Tables as text: CSV and JSON lines.

use pursuit_measuring::{Cells, Column, Table};
use rayon::prelude::*;
use std::fmt::Write as _;

/// Rows that one thread writes at a time.
const CHUNK: usize = 4_096;

/// The whole table as CSV, one header line.
pub(super) fn csv(table: &Table) -> Vec<u8> {
    let names: Vec<&str> = table.columns.iter().map(|c| c.name.as_str()).collect();
    let mut out = names.join(",").into_bytes();
    out.push(b'\n');
    out.extend(rows(table, |out, row| {
        for (i, column) in table.columns.iter().enumerate() {
            if i > 0 {
                out.push(b',');
            }
            push(out, column, row);
        }
        out.push(b'\n');
    }));
    out
}

/// The same with semicolons between cells and commas in numbers; words hold neither commas nor points.
pub(super) fn csv_semicolon(table: &Table) -> Vec<u8> {
    let changed = |byte| match byte {
        b',' => b';',
        b'.' => b',',
        byte => byte,
    };
    csv(table).into_iter().map(changed).collect()
}

/// The whole table as JSON, one object a line; an empty cell is `null`.
pub(super) fn jsonl(table: &Table) -> Vec<u8> {
    rows(table, |out, row| {
        for (i, column) in table.columns.iter().enumerate() {
            out.push(if i == 0 { b'{' } else { b',' });
            out.extend_from_slice(format!("\"{}\":", column.name).as_bytes());
            let (quoted, before) = (matches!(column.cells, Cells::Word(_) | Cells::Kind(_)), out.len());
            push(out, column, row);
            if quoted {
                out.insert(before, b'"');
                out.push(b'"');
            } else if out.len() == before {
                out.extend_from_slice(b"null");
            }
        }
        out.extend_from_slice(b"}\n");
    })
}

fn rows(table: &Table, row: impl Fn(&mut Vec<u8>, usize) + Sync) -> Vec<u8> {
    let count = table.len();
    let chunks: Vec<Vec<u8>> = (0..count.div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| {
            let mut out = Vec::with_capacity(CHUNK * 16 * table.columns.len());
            (chunk * CHUNK..count.min((chunk + 1) * CHUNK)).for_each(|k| row(&mut out, k));
            out
        })
        .collect();
    chunks.concat()
}

fn push(out: &mut Vec<u8>, column: &Column, row: usize) {
    match &column.cells {
        Cells::Whole(values) => values.get(row).iter().for_each(|v| push_whole(out, **v)),
        Cells::Number(values, decimals) => values.get(row).iter().for_each(|v| push_fixed(out, **v, *decimals)),
        Cells::Word(values) => values.get(row).iter().for_each(|v| out.extend_from_slice(v.as_bytes())),
        Cells::Kind(values) => values.get(row).iter().for_each(|v| out.extend_from_slice(v.as_bytes())),
    }
}

fn push_whole(out: &mut Vec<u8>, mut value: u64) {
    let start = out.len();
    loop {
        out.push(b'0' + (value % 10) as u8);
        value /= 10;
        if value == 0 {
            break;
        }
    }
    if let Some(digits) = out.get_mut(start..) {
        digits.reverse();
    }
}

/// A number to so many decimals, nothing for what is no number. A few times as fast as `format!`, which matters for the millions
/// of cells of a long run.
fn push_fixed(out: &mut Vec<u8>, value: f64, decimals: usize) {
    /// Whole numbers up to here are exact.
    const EXACT: f64 = 9e15;
    if !value.is_finite() {
        return;
    }
    let scaled = (value.abs() * 10_f64.powi(decimals as i32)).round();
    if scaled > EXACT {
        let mut text = String::new();
        let _ = write!(text, "{value:.decimals$}");
        out.extend_from_slice(text.as_bytes());
        return;
    }
    let scaled = scaled as u64;
    if value < 0.0 && scaled > 0 {
        out.push(b'-');
    }
    let unit = 10_u64.pow(decimals as u32);
    push_whole(out, scaled / unit);
    if decimals > 0 {
        out.push(b'.');
        let (start, mut rest) = (out.len(), scaled % unit);
        for _ in 0..decimals {
            out.push(b'0' + (rest % 10) as u8);
            rest /= 10;
        }
        if let Some(digits) = out.get_mut(start..) {
            digits.reverse();
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_as_format_does() {
        let write = |value: f64, decimals: usize| {
            let mut out = Vec::new();
            push_fixed(&mut out, value, decimals);
            String::from_utf8(out).unwrap()
        };
        for value in [0.0, 1.0, -1.25, 12.000_4, -0.062_5, 123_456.789, -3e-9, 9.99] {
            for decimals in [0, 1, 3, 6, 12] {
                let expected = format!("{value:.decimals$}");
                let found = write(value, decimals);
                assert!(
                    (found.parse::<f64>().unwrap() - expected.parse::<f64>().unwrap()).abs()
                        < 1.01 * 10_f64.powi(-(decimals as i32)),
                    "{found} {expected}"
                );
                assert_eq!(found.split('.').nth(1).map(str::len), expected.split('.').nth(1).map(str::len));
            }
        }
        assert_eq!((write(-1e-9, 3), write(1e20, 2)), ("0.000".to_owned(), "100000000000000000000.00".to_owned()));
        assert_eq!((write(f64::NAN, 3), write(f64::INFINITY, 3)), (String::new(), String::new()));
    }

    #[test]
    fn tables_become_text_row_by_row() {
        let column = |name: &str, cells| Column { name: name.to_owned(), cells };
        let table = Table {
            columns: vec![
                column("frame", Cells::Whole((0..5_000).collect())),
                column(
                    "x_m",
                    Cells::Number((0..5_000).map(|k| if k == 1 { f64::NAN } else { f64::from(k) * 0.5 }).collect(), 2),
                ),
                column("how", Cells::Kind(vec!["measured"; 5_000])),
            ],
        };
        let csv = String::from_utf8(csv(&table)).unwrap();
        let lines: Vec<&str> = csv.lines().collect();
        assert_eq!(
            (lines.len(), lines[0], lines[2], lines[5_000]),
            (5_001, "frame,x_m,how", "1,,measured", "4999,2499.50,measured")
        );
        let json = String::from_utf8(jsonl(&table)).unwrap();
        let second: serde_json::Value = serde_json::from_str(json.lines().nth(1).unwrap()).unwrap();
        assert!(second["x_m"].is_null() && second["how"] == "measured" && second["frame"] == 1);
    }
}
