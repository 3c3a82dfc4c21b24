use crate::sinks::{Moment, Sink, create};
use crate::{Record, RunError};
use parquet::basic::{Compression, Repetition, Type};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::Type as Schema;
use pursuit_geometry::BBox;
use pursuit_tracking::{Class, Doubt};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Records gathered before they are written as one row group; a crash loses at most these (the CSV loses none).
const ROWS_A_GROUP: usize = 1_000;

/// Writes `trajectory.parquet` with the columns of the CSV; an empty cell is a null.
pub struct ParquetSink {
    path: PathBuf,
    writer: Option<SerializedFileWriter<File>>,
    pending: Vec<Record>,
}

impl ParquetSink {
    /// Creates the file.
    ///
    /// # Errors
    /// [`RunError::Output`] when it cannot be written.
    pub fn create(path: &Path) -> Result<Self, RunError> {
        let failed = |e: ParquetError| RunError::output(path)(std::io::Error::other(e));
        let properties = WriterProperties::builder().set_compression(Compression::UNCOMPRESSED).build();
        let schema = Arc::new(schema().map_err(failed)?);
        let writer = SerializedFileWriter::new(create(path)?, schema, Arc::new(properties)).map_err(failed)?;
        Ok(Self { path: path.to_path_buf(), writer: Some(writer), pending: Vec::new() })
    }

    fn flush(&mut self) -> Result<(), RunError> {
        let Some(writer) = self.writer.as_mut().filter(|_| !self.pending.is_empty()) else { return Ok(()) };
        let written = writer.next_row_group().and_then(|group| write_group(group, &self.pending));
        self.pending.clear();
        written.map_err(|e| RunError::output(&self.path)(std::io::Error::other(e)))
    }
}

impl Sink for ParquetSink {
    fn write(&mut self, moment: &Moment<'_>) -> Result<(), RunError> {
        self.pending.extend_from_slice(moment.records);
        if self.pending.len() >= ROWS_A_GROUP { self.flush() } else { Ok(()) }
    }

    fn finish(&mut self) -> Result<(), RunError> {
        self.flush()?;
        match self.writer.take().map(SerializedFileWriter::close) {
            Some(Err(e)) => Err(RunError::output(&self.path)(std::io::Error::other(e))),
            _ => Ok(()),
        }
    }

    fn files(&self) -> Vec<PathBuf> {
        vec![self.path.clone()]
    }
}

/// A number that may be missing.
type Cell = fn(&Record) -> Option<f64>;

const NUMBERS: [(&str, Cell); 14] = [
    ("x", |r| estimate(r).map(|b| b.left())),
    ("y", |r| estimate(r).map(|b| b.top())),
    ("w", |r| estimate(r).map(|b| b.width())),
    ("h", |r| estimate(r).map(|b| b.height())),
    ("score", |r| r.estimate.as_ref().map(|e| e.score)),
    ("pred_x", |r| prediction(r).map(|b| b.left())),
    ("pred_y", |r| prediction(r).map(|b| b.top())),
    ("pred_w", |r| prediction(r).map(|b| b.width())),
    ("pred_h", |r| prediction(r).map(|b| b.height())),
    ("meas_x", |r| measurement(r).map(|b| b.left())),
    ("meas_y", |r| measurement(r).map(|b| b.top())),
    ("meas_w", |r| measurement(r).map(|b| b.width())),
    ("meas_h", |r| measurement(r).map(|b| b.height())),
    ("update_ms", |r| r.update_ms),
];

/// A word that may be missing.
type Word = fn(&Record) -> Option<&str>;

const WORDS: [(&str, Word); 2] = [
    ("class", |r| r.class.as_ref().map(Class::as_str)),
    ("doubt", |r| r.estimate.as_ref().and_then(|e| e.doubt).map(Doubt::as_str)),
];

fn estimate(r: &Record) -> Option<BBox> {
    r.estimate.as_ref().map(|e| e.bbox)
}

fn prediction(r: &Record) -> Option<BBox> {
    r.estimate.as_ref().and_then(|e| e.prediction)
}

fn measurement(r: &Record) -> Option<BBox> {
    r.estimate.as_ref().and_then(|e| e.measurement)
}

fn schema() -> Result<Schema, ParquetError> {
    let column = |name: &str, of: Type, repetition: Repetition| {
        Ok::<_, ParquetError>(Arc::new(Schema::primitive_type_builder(name, of).with_repetition(repetition).build()?))
    };
    let mut fields = vec![
        column("frame", Type::INT64, Repetition::REQUIRED)?,
        column("time_s", Type::DOUBLE, Repetition::REQUIRED)?,
        column("target", Type::INT64, Repetition::REQUIRED)?,
    ];
    let word = |name: &str, repetition: Repetition| {
        let word = Schema::primitive_type_builder(name, Type::BYTE_ARRAY)
            .with_repetition(repetition)
            .with_logical_type(Some(parquet::basic::LogicalType::String));
        Ok::<_, ParquetError>(Arc::new(word.build()?))
    };
    fields.push(word("state", Repetition::REQUIRED)?);
    for (name, _) in NUMBERS {
        fields.push(column(name, Type::DOUBLE, Repetition::OPTIONAL)?);
    }
    for (name, _) in WORDS {
        fields.push(word(name, Repetition::OPTIONAL)?);
    }
    Schema::group_type_builder("trajectory").with_fields(fields).build()
}

fn write_group(mut group: SerializedRowGroupWriter<'_, File>, rows: &[Record]) -> Result<(), ParquetError> {
    let state = |r: &Record| ByteArray::from(r.estimate.as_ref().map_or("lost", |e| e.state.as_str()));
    write_column::<Int64Type>(&mut group, rows.iter().map(|r| Some(r.frame as i64)), false)?;
    write_column::<DoubleType>(&mut group, rows.iter().map(|r| Some(r.time_s)), false)?;
    write_column::<Int64Type>(&mut group, rows.iter().map(|r| Some(r.target.0 as i64)), false)?;
    write_column::<ByteArrayType>(&mut group, rows.iter().map(|r| Some(state(r))), false)?;
    for (_, cell) in NUMBERS {
        write_column::<DoubleType>(&mut group, rows.iter().map(cell), true)?;
    }
    for (_, word) in WORDS {
        write_column::<ByteArrayType>(&mut group, rows.iter().map(|r| word(r).map(ByteArray::from)), true)?;
    }
    group.close()?;
    Ok(())
}

/// Writes the next column of a group; a cell that is not there is a null, where the column may have such.
pub(crate) fn write_column<T: parquet::data_type::DataType>(
    group: &mut SerializedRowGroupWriter<'_, File>,
    cells: impl Iterator<Item = Option<T::T>>,
    optional: bool,
) -> Result<(), ParquetError> {
    let (mut values, mut levels) = (Vec::new(), Vec::new());
    for cell in cells {
        levels.push(i16::from(cell.is_some()));
        values.extend(cell);
    }
    if let Some(mut column) = group.next_column()? {
        column.typed::<T>().write_batch(&values, optional.then_some(levels.as_slice()), None)?;
        column.close()?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::RowAccessor;
    use pursuit_imaging::{Frame, Image};
    use pursuit_tracking::TargetId;

    #[test]
    fn rows_come_back_with_nulls_where_nothing_is_known() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.parquet");
        let mut sink = ParquetSink::create(&path).unwrap();
        let frame = Arc::new(Frame::new(0, 0.0, Image::from_fn(4, 4, |_, _| 0_u8).unwrap()));
        // One more than a row group holds.
        for frame_number in 0..=ROWS_A_GROUP as u64 {
            let time_s = frame_number as f64 / 25.0;
            let record = Record {
                frame: frame_number,
                time_s,
                target: TargetId(3),
                class: (frame_number == 7).then(|| Class::from("person")),
                estimate: None,
                update_ms: Some(0.5),
            };
            sink.write(&Moment::recorded(&frame, &[record])).unwrap();
        }
        sink.finish().unwrap();
        sink.finish().unwrap();
        let reader = SerializedFileReader::new(File::open(&path).unwrap()).unwrap();
        assert_eq!((reader.num_row_groups(), reader.metadata().file_metadata().num_rows()), (2, 1001));
        let rows: Vec<_> = reader.get_row_iter(None).unwrap().map(Result::unwrap).collect();
        assert_eq!(
            (rows[7].get_long(0).unwrap(), rows[7].get_double(1).unwrap(), rows[7].get_long(2).unwrap()),
            (7, 0.28, 3)
        );
        assert_eq!(rows[1000].get_string(3).unwrap(), "lost");
        assert!(rows[7].get_double(4).is_err(), "there is no box");
        assert_eq!(rows[7].get_double(17).unwrap(), 0.5);
        assert_eq!(rows[7].get_string(18).unwrap(), "person");
        assert!(rows[8].get_string(18).is_err() && rows[7].get_string(19).is_err());
    }
}
