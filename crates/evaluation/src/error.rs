use std::path::{Path, PathBuf};

/// What can go wrong around an evaluation. A tracker that fails is a result, not an error.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EvaluationError {
    /// A file of a data set that cannot be read or understood.
    #[error("{}{}: {reason}", path.display(), line.map(|n| format!(":{n}")).unwrap_or_default())]
    Dataset {
        /// The file or folder.
        path: PathBuf,
        /// The line, from 1, where one is to blame.
        line: Option<usize>,
        /// What is wrong and what would mend it.
        reason: String,
    },
    /// Nothing to evaluate on.
    #[error("{name}: no sequence {reason}")]
    NoSequences {
        /// What was searched.
        name: String,
        /// Which sequences were looked for.
        reason: String,
    },
    /// Frames that cannot be had.
    #[error("sequence {sequence}: {cause}")]
    Frames {
        /// Name of the sequence.
        sequence: String,
        /// What the media layer says. (Not called `source`: it is part of the message, and would be printed twice.)
        cause: pursuit_media::MediaError,
    },
    /// A result that cannot be written or read back.
    #[error("{}: {reason}", path.display())]
    Output {
        /// The file or folder.
        path: PathBuf,
        /// What is wrong and what would mend it.
        reason: String,
    },
    /// A part of the results that its format cannot hold.
    #[error("{what} cannot be encoded: {reason}")]
    Encoding {
        /// What was to be written.
        what: String,
        /// What the encoder says.
        reason: String,
    },
    /// An option that makes no sense.
    #[error("{0}")]
    Option(String),
}

impl EvaluationError {
    pub(crate) fn dataset(path: &Path, line: impl Into<Option<usize>>, reason: impl Into<String>) -> Self {
        Self::Dataset { path: path.to_owned(), line: line.into(), reason: reason.into() }
    }

    pub(crate) fn output(path: &Path, reason: impl std::fmt::Display) -> Self {
        Self::Output { path: path.to_owned(), reason: reason.to_string() }
    }

    pub(crate) fn encoding(what: impl Into<String>, reason: impl std::fmt::Display) -> Self {
        Self::Encoding { what: what.into(), reason: reason.to_string() }
    }

    /// Whether results could not be written; the other variants are about reading and about options.
    pub const fn is_output(&self) -> bool {
        matches!(self, Self::Output { .. } | Self::Encoding { .. })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn encoding_errors_name_the_output() {
        let error = EvaluationError::encoding("a picture of the report", "too wide");
        assert_eq!(error.to_string(), "a picture of the report cannot be encoded: too wide");
        assert!(error.is_output());
        assert!(EvaluationError::output(Path::new("results.json"), "disk full").is_output());
        assert!(!EvaluationError::Option("no tracker".to_owned()).is_output());
        assert!(!EvaluationError::dataset(Path::new("gt.txt"), 3, "not a number").is_output());
    }
}
