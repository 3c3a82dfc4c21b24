use super::{CsvSink, JsonlSink, MotSink, PredictionsSink, Sink};
use crate::RunError;
use std::fmt;
use std::path::Path;
use std::str::FromStr;

/// The formats of a trajectory: the one list of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Format {
    /// A row for every frame and target; always written.
    Csv,
    /// A JSON object a line, with covariances and diagnostics.
    Jsonl,
    /// MOTChallenge.
    Mot,
    /// Parquet, in builds with the feature `parquet`.
    Parquet,
    /// Actual and predicted positions side by side, as text.
    Predictions,
}

impl Format {
    /// All of them, built in or not.
    pub const ALL: [Self; 5] = [Self::Csv, Self::Jsonl, Self::Mot, Self::Parquet, Self::Predictions];

    /// The name that commands and configurations use.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Csv => "csv",
            Self::Jsonl => "jsonl",
            Self::Mot => "mot",
            Self::Parquet => "parquet",
            Self::Predictions => "predictions",
        }
    }

    /// What it is, in a line.
    pub const fn summary(self) -> &'static str {
        match self {
            Self::Csv => "A row for every frame and target (always written)",
            Self::Jsonl => "A JSON object a line, with covariances and diagnostics",
            Self::Mot => "MOTChallenge: measured targets only, counted from 1",
            Self::Parquet => "The columns of the CSV as Parquet",
            Self::Predictions => "A text table of actual positions beside those predicted a sample before",
        }
    }

    /// The file that it is written to, in a run's folder.
    pub const fn file_name(self) -> &'static str {
        match self {
            Self::Csv => "trajectory.csv",
            Self::Jsonl => "trajectory.jsonl",
            Self::Mot => "trajectory.txt",
            Self::Parquet => "trajectory.parquet",
            Self::Predictions => "predictions.txt",
        }
    }

    /// Creates its file in `folder`.
    ///
    /// # Errors
    /// [`RunError::Output`] when it cannot be written, [`RunError::Usage`] when this build cannot write the format.
    pub fn create(self, folder: &Path) -> Result<Box<dyn Sink>, RunError> {
        let path = folder.join(self.file_name());
        Ok(match self {
            Self::Csv => Box::new(CsvSink::create(&path)?),
            Self::Jsonl => Box::new(JsonlSink::create(&path)?),
            Self::Mot => Box::new(MotSink::create(&path)?),
            Self::Predictions => Box::new(PredictionsSink::create(&path)?),
            #[cfg(feature = "parquet")]
            Self::Parquet => Box::new(super::ParquetSink::create(&path)?),
            #[cfg(not(feature = "parquet"))]
            Self::Parquet => return Err(missing()),
        })
    }
}

impl Format {
    /// Goes on with its file in `folder`.
    ///
    /// # Errors
    /// [`RunError::Output`] when it cannot be written, [`RunError::Usage`] for a format that cannot be added to.
    pub(crate) fn append(self, folder: &Path) -> Result<Box<dyn Sink>, RunError> {
        let path = folder.join(self.file_name());
        Ok(match self {
            Self::Csv => Box::new(CsvSink::append(&path)?),
            Self::Jsonl => Box::new(JsonlSink::append(&path)?),
            Self::Mot => Box::new(MotSink::append(&path)?),
            Self::Parquet | Self::Predictions => {
                return Err(RunError::usage(format!("nothing can be added to a file of the format {self}")));
            }
        })
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Format {
    type Err = RunError;

    /// # Errors
    /// [`RunError::Usage`] for a name that is none, or a format that this build cannot write.
    fn from_str(name: &str) -> Result<Self, RunError> {
        match Self::ALL.into_iter().find(|f| f.name() == name) {
            Some(Self::Parquet) if !cfg!(feature = "parquet") => Err(missing()),
            Some(format) => Ok(format),
            None => {
                let all = Self::ALL.map(Self::name).join(", ");
                Err(RunError::usage(format!("there is no format `{name}`; there are: {all}")))
            }
        }
    }
}

fn missing() -> RunError {
    RunError::usage("this build cannot write Parquet; build with `--features parquet`")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_back_and_what_is_missing_is_told() {
        for format in Format::ALL {
            match format.to_string().parse::<Format>() {
                Ok(read) => assert_eq!(read, format),
                Err(error) => {
                    assert!(format == Format::Parquet && !cfg!(feature = "parquet"));
                    assert!(error.to_string().contains("--features parquet"), "{error}");
                }
            }
        }
        let error = "xml".parse::<Format>().unwrap_err();
        assert!(
            error.to_string().contains("`xml`") && error.to_string().contains("csv, jsonl, mot, parquet, predictions"),
            "{error}"
        );
        assert_eq!(error.exit_code(), 2);
    }

    #[test]
    fn every_format_creates_its_file() {
        let folder = tempfile::tempdir().unwrap();
        for format in Format::ALL.into_iter().filter(|f| f.name().parse::<Format>().is_ok()) {
            let mut sink = format.create(folder.path()).unwrap();
            sink.finish().unwrap();
            assert!(folder.path().join(format.file_name()).is_file(), "{format}");
        }
        let occupied = folder.path().join("trajectory.csv");
        assert_eq!(Format::Csv.create(&occupied).err().unwrap().exit_code(), 4);
    }
}
