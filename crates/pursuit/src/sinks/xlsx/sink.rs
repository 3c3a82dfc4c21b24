use crate::RunError;
use crate::sinks::csv::cells;
use crate::sinks::{Moment, Sink, TRAJECTORY_COLUMNS, create};
use rust_xlsxwriter::{Format, Workbook, XlsxError};
use std::path::{Path, PathBuf};

/// Rows that a sheet can hold below its header; what is longer goes on in another sheet.
const ROWS_A_SHEET: u32 = 1_048_575;

/// Writes `trajectory.xlsx`: rows are kept until the end, about a kilobyte each.
pub struct XlsxSink {
    path: PathBuf,
    book: Option<Workbook>,
    /// Rows in the last sheet; as many as it can hold before the first.
    rows: u32,
}

impl XlsxSink {
    /// Creates the file, empty until the end.
    ///
    /// # Errors
    /// [`RunError::Output`] when it cannot be written.
    pub fn create(path: &Path) -> Result<Self, RunError> {
        create(path)?;
        Ok(Self { path: path.to_path_buf(), book: Some(Workbook::new()), rows: ROWS_A_SHEET })
    }

    fn add(&mut self, moment: &Moment<'_>) -> Result<(), XlsxError> {
        let Some(book) = &mut self.book else { return Ok(()) };
        for record in moment.records {
            if self.rows == ROWS_A_SHEET {
                let number = book.worksheets().len() + 1;
                let sheet = book.add_worksheet();
                sheet.set_name(format!("trajectory {number}"))?.set_freeze_panes(1, 0)?;
                for (name, column) in TRAJECTORY_COLUMNS.into_iter().zip(0_u16..) {
                    sheet.write_with_format(0, column, name, &Format::new().set_bold())?;
                }
                self.rows = 0;
            }
            self.rows += 1;
            let last = book.worksheets().len() - 1;
            let sheet = book.worksheet_from_index(last)?;
            for (cell, column) in cells(record).iter().zip(0_u16..) {
                match cell.parse::<f64>() {
                    Ok(number) if number.is_finite() => sheet.write(self.rows, column, number)?,
                    _ if cell.is_empty() => continue,
                    _ => sheet.write(self.rows, column, cell.as_str())?,
                };
            }
        }
        Ok(())
    }
}

impl Sink for XlsxSink {
    fn write(&mut self, moment: &Moment<'_>) -> Result<(), RunError> {
        self.add(moment).map_err(|e| RunError::output(&self.path)(std::io::Error::other(e)))
    }

    fn finish(&mut self) -> Result<(), RunError> {
        let Some(mut book) = self.book.take() else { return Ok(()) };
        if book.worksheets().is_empty() {
            book.add_worksheet();
        }
        book.save(&self.path).map_err(|e| RunError::output(&self.path)(std::io::Error::other(e)))
    }

    fn files(&self) -> Vec<PathBuf> {
        vec![self.path.clone()]
    }
}
