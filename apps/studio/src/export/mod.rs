//! Trajectories as files.

mod table;

use crate::error::Refusal;
use crate::trial::Told;
use pursuit::RunError;
use pursuit::sinks::Format;
use serde::Deserialize;

/// How a trajectory is written down.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(try_from = "String")]
pub(crate) enum Export {
    /// The paper's text table: actual and predicted positions.
    Table,
    /// As `pursuit track` writes it.
    Format(Format),
}

impl TryFrom<String> for Export {
    type Error = RunError;

    fn try_from(name: String) -> Result<Self, RunError> {
        if name == "table" { Ok(Self::Table) } else { name.parse().map(Self::Format) }
    }
}

impl Export {
    pub fn write(self, told: &Told) -> Result<Vec<u8>, Refusal> {
        let rows = told.version.rows.iter().map(|row| &**row);
        match self {
            Self::Table => Ok(table::write(told).into_bytes()),
            Self::Format(format) => Ok(format.of_rows(rows, &told.edits, told.info.size)?),
        }
    }

    pub const fn file_name(self) -> &'static str {
        match self {
            Self::Table => "targets.txt",
            Self::Format(format) => format.file_name(),
        }
    }

    pub const fn media_type(self) -> &'static str {
        match self {
            Self::Table => "text/plain; charset=utf-8",
            Self::Format(format) => format.media_type(),
        }
    }
}
