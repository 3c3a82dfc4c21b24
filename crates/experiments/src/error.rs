use pursuit_estimation::EstimationError;
use pursuit_tracking::TrackingError;
use std::path::PathBuf;

/// What can stop an experiment.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExperimentError {
    /// What was asked for makes no sense.
    #[error("{message}")]
    Usage {
        /// What is wrong, and what would be right.
        message: String,
    },
    /// A filter refuses its parameters or a measurement.
    #[error(transparent)]
    Estimation(#[from] EstimationError),
    /// A motion filter of the tracking loop does.
    #[error(transparent)]
    Tracking(#[from] TrackingError),
    /// A file cannot be written.
    #[error("cannot write {}: {source}; what was written before is kept", path.display())]
    Output {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

impl ExperimentError {
    /// The exit status of a program that this ends: 2 wrong usage, 4 output that cannot be written, 1 anything else.
    pub const fn exit_code(&self) -> u8 {
        match self {
            Self::Usage { .. } => 2,
            Self::Output { .. } => 4,
            Self::Estimation(_) | Self::Tracking(_) => 1,
        }
    }

    pub(crate) fn usage(message: impl Into<String>) -> Self {
        Self::Usage { message: message.into() }
    }

    pub(crate) fn output(path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        move |source| Self::Output { path, source }
    }
}
