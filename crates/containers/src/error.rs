/// What stops a reader or a writer. The messages name no file: whoever opened it puts the name before them.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ContainerError {
    /// Sound as far as we can tell, but not read here; names the codec or feature.
    #[error("{what} is not read here")]
    Unsupported {
        /// The codec or feature.
        what: String,
    },
    /// Broken, hostile, or not what it claims to be.
    #[error("{reason}")]
    Malformed {
        /// What is wrong and, where something can be done, what would mend it.
        reason: String,
    },
    /// What cannot be written.
    #[error("{reason}")]
    Unwritable {
        /// Why, and what would mend it.
        reason: String,
    },
}

impl ContainerError {
    pub(crate) fn unsupported(what: impl Into<String>) -> Self {
        Self::Unsupported { what: what.into() }
    }

    pub(crate) fn malformed(reason: impl Into<String>) -> Self {
        Self::Malformed { reason: reason.into() }
    }

    pub(crate) fn unwritable(reason: impl Into<String>) -> Self {
        Self::Unwritable { reason: reason.into() }
    }
}

impl From<std::io::Error> for ContainerError {
    /// Of reading.
    fn from(error: std::io::Error) -> Self {
        Self::malformed(match error.kind() {
            std::io::ErrorKind::UnexpectedEof => "the file ends early".to_owned(),
            _ => error.to_string(),
        })
    }
}
