//! `measure.parquet`: the columns of the CSV, to all their digits.

use crate::RunError;
use crate::sinks::parquet_column as write_column;
use ::parquet::basic::{Compression, LogicalType, Repetition, Type};
use ::parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use ::parquet::errors::ParquetError;
use ::parquet::file::properties::WriterProperties;
use ::parquet::file::writer::SerializedFileWriter;
use ::parquet::schema::types::Type as Schema;
use pursuit_measuring::{Cells, Table};
use std::path::Path;
use std::sync::Arc;

pub(super) fn write(path: &Path, table: &Table) -> Result<(), RunError> {
    let file = std::fs::File::create(path).map_err(RunError::output(path))?;
    write_table(file, table).map_err(|e| RunError::output(path)(std::io::Error::other(e)))
}

fn write_table(file: std::fs::File, table: &Table) -> Result<(), ParquetError> {
    let properties = WriterProperties::builder().set_compression(Compression::UNCOMPRESSED).build();
    let mut writer = SerializedFileWriter::new(file, Arc::new(schema(table)?), Arc::new(properties))?;
    let mut group = writer.next_row_group()?;
    for column in &table.columns {
        let text = |text: &str| Some(ByteArray::from(text));
        match &column.cells {
            Cells::Whole(values) => {
                write_column::<Int64Type>(&mut group, values.iter().map(|v| Some(*v as i64)), false)?
            }
            Cells::Number(values, _) => {
                let cells = values.iter().map(|v| v.is_finite().then_some(*v));
                write_column::<DoubleType>(&mut group, cells, true)?;
            }
            Cells::Word(values) => write_column::<ByteArrayType>(&mut group, values.iter().map(|v| text(v)), false)?,
            Cells::Kind(values) => write_column::<ByteArrayType>(&mut group, values.iter().map(|v| text(v)), false)?,
        }
    }
    group.close()?;
    writer.close()?;
    Ok(())
}

fn schema(table: &Table) -> Result<Schema, ParquetError> {
    let field = |column: &pursuit_measuring::Column| {
        let (kind, repetition) = match column.cells {
            Cells::Whole(_) => (Type::INT64, Repetition::REQUIRED),
            Cells::Number(..) => (Type::DOUBLE, Repetition::OPTIONAL),
            Cells::Word(_) | Cells::Kind(_) => (Type::BYTE_ARRAY, Repetition::REQUIRED),
        };
        let built = Schema::primitive_type_builder(&column.name, kind).with_repetition(repetition);
        let text = (kind == Type::BYTE_ARRAY).then_some(LogicalType::String);
        Ok(Arc::new(built.with_logical_type(text).build()?))
    };
    let fields = table.columns.iter().map(field).collect::<Result<Vec<_>, ParquetError>>()?;
    Schema::group_type_builder("measure").with_fields(fields).build()
}
