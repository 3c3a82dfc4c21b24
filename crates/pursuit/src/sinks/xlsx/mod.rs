#[cfg(feature = "xlsx")]
mod sink;

use super::format::{Declared, Format, Kind};

pub(super) const FORMAT: Format = Format(&Declared {
    name: "xlsx",
    summary: "The columns of the CSV as a spreadsheet; written at the end",
    file_name: "trajectory.xlsx",
    media_type: "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet",
    #[cfg(feature = "xlsx")]
    kind: Kind::File(|path| Ok(Box::new(sink::XlsxSink::create(path)?))),
    #[cfg(not(feature = "xlsx"))]
    kind: Kind::Missing("this build cannot write spreadsheets; build with `--features xlsx`, or take `csv-semicolon`"),
});
