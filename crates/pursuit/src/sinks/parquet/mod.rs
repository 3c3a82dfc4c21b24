#[cfg(feature = "parquet")]
mod sink;

#[cfg(feature = "parquet")]
pub use sink::ParquetSink;
#[cfg(feature = "parquet")]
pub(crate) use sink::write_column;

use super::format::{Declared, Format, Kind};

pub(super) const FORMAT: Format = Format(&Declared {
    name: "parquet",
    summary: "The columns of the CSV as Parquet",
    file_name: "trajectory.parquet",
    media_type: "application/vnd.apache.parquet",
    #[cfg(feature = "parquet")]
    kind: Kind::File(|path| Ok(Box::new(ParquetSink::create(path)?))),
    #[cfg(not(feature = "parquet"))]
    kind: Kind::Missing("this build cannot write Parquet; build with `--features parquet`"),
});
