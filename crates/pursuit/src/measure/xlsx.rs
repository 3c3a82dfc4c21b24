//! `measure.xlsx`: a spreadsheet for whoever cannot read a CSV with decimal points.

use super::Measurement;
use crate::RunError;
use pursuit_measuring::{Cells, Table};
use rust_xlsxwriter::{Format, Workbook, Worksheet, XlsxError};
use std::path::Path;

/// Rows that a sheet can hold, the header among them.
const MOST_ROWS: usize = 1_048_576;

pub(super) fn write(path: &Path, table: &Table, found: &Measurement) -> Result<(), RunError> {
    std::fs::write(path, bytes(table, found)?).map_err(RunError::output(path))
}

pub(super) fn bytes(table: &Table, found: &Measurement) -> Result<Vec<u8>, RunError> {
    if table.len() >= MOST_ROWS {
        return Err(RunError::usage(format!(
            "a sheet has {MOST_ROWS} rows and the run {}; take the CSV or Parquet, or measure a part of the run",
            table.len()
        )));
    }
    let mut book = Workbook::new();
    let bold = Format::new().set_bold();
    let mut made = || -> Result<Vec<u8>, XlsxError> {
        sheet(book.add_worksheet(), "motion", table, &bold)?;
        sheet(book.add_worksheet(), "events", &found.events_table(), &bold)?;
        sheet(book.add_worksheet(), "zones", &found.stays_table(), &bold)?;
        fits(book.add_worksheet(), found, &bold)?;
        book.save_to_buffer()
    };
    made().map_err(|e| RunError::output("measure.xlsx")(std::io::Error::other(e)))
}

fn sheet(sheet: &mut Worksheet, name: &str, table: &Table, bold: &Format) -> Result<(), XlsxError> {
    sheet.set_name(name)?.set_freeze_panes(1, 0)?;
    for (column, at) in table.columns.iter().zip(0_u16..) {
        sheet.set_column_width(at, column.name.len().max(8) as f64)?;
        sheet.write_with_format(0, at, column.name.as_str(), bold)?;
    }
    for row in 0..table.len() {
        let line = u32::try_from(row + 1).unwrap_or(u32::MAX);
        for (column, at) in table.columns.iter().zip(0_u16..) {
            match &column.cells {
                Cells::Whole(values) => sheet.write(line, at, values[row] as f64)?,
                Cells::Number(values, _) if values[row].is_finite() => sheet.write(line, at, values[row])?,
                Cells::Number(..) => continue,
                Cells::Word(values) => sheet.write(line, at, values[row].as_str())?,
                Cells::Kind(values) => sheet.write(line, at, values[row])?,
            };
        }
    }
    Ok(())
}

fn fits(sheet: &mut Worksheet, found: &Measurement, bold: &Format) -> Result<(), XlsxError> {
    sheet.set_name("fits")?;
    for (name, at) in ["target", "fit", "from_s", "to_s", "parameter", "value", "sd", "unit"].into_iter().zip(0_u16..) {
        sheet.write_with_format(0, at, name, bold)?;
    }
    let rows = found.fits.iter().flat_map(|fit| fit.parameters.iter().map(move |p| (fit, p)));
    for ((fit, parameter), row) in rows.zip(1_u32..) {
        sheet.write(row, 0, fit.target as f64)?.write(row, 1, fit.asked.shape.name())?;
        sheet.write(row, 2, fit.from_s)?.write(row, 3, fit.to_s)?;
        sheet.write(row, 4, parameter.name)?.write(row, 5, parameter.value)?;
        sheet.write(row, 6, parameter.error)?.write(row, 7, parameter.unit.as_str())?;
    }
    Ok(())
}
