use pursuit_estimation::EstimationError;
use pursuit_evaluation::EvaluationError;
use pursuit_measuring::MeasuringError;
use pursuit_media::MediaError;
use pursuit_parameters::ParameterError;
use pursuit_tracking::TrackingError;
use std::path::PathBuf;

/// What can end a run early.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// What was asked for makes no sense.
    #[error("{message}")]
    Usage {
        /// What is wrong, and what would be right.
        message: String,
    },
    /// The input cannot be read (any further).
    #[error(transparent)]
    Input(#[from] MediaError),
    /// A tracker or detector refuses its parameters, its start box or a frame.
    #[error(transparent)]
    Tracking(#[from] TrackingError),
    /// A parameter that does not exist or has a senseless value.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// An evaluation that cannot be run or kept.
    #[error(transparent)]
    Evaluation(#[from] EvaluationError),
    /// A filter refuses its parameters or a measurement.
    #[error(transparent)]
    Estimation(#[from] EstimationError),
    /// A calibration, or something that cannot be measured.
    #[error(transparent)]
    Measuring(#[from] MeasuringError),
    /// A pan-tilt head, or what is said of one.
    #[cfg(feature = "ptz")]
    #[error(transparent)]
    Head(#[from] pursuit_ptz::PtzError),
    /// A file cannot be written.
    #[error("cannot write {}: {source}; what was written before is kept", path.display())]
    Output {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

impl RunError {
    /// The exit status that the README promises: 2 wrong usage, 3 input that cannot be read, 4 output that cannot be written.
    pub const fn exit_code(&self) -> u8 {
        match self {
            Self::Measuring(MeasuringError::Smoothing { .. }) => 1,
            Self::Usage { .. } | Self::Parameter(_) | Self::Measuring(_) => 2,
            Self::Input(e) if e.is_output() => 4,
            Self::Input(_) => 3,
            Self::Evaluation(e) if e.is_output() => 4,
            Self::Evaluation(EvaluationError::Option(_)) => 2,
            Self::Evaluation(_) => 3,
            Self::Output { .. } => 4,
            Self::Estimation(_) => 1,
            #[cfg(feature = "ptz")]
            Self::Head(_) => 1,
            Self::Tracking(e) => match e {
                TrackingError::FrameSize { .. } | TrackingError::MissingPlane { .. } => 3,
                TrackingError::StartBox { .. }
                | TrackingError::Parameter(_)
                | TrackingError::UnknownName { .. }
                | TrackingError::NotBuiltIn { .. }
                | TrackingError::UnknownTarget { .. } => 2,
                _ => 1,
            },
        }
    }

    /// Wrong usage, in words.
    pub fn usage(message: impl Into<String>) -> Self {
        Self::Usage { message: message.into() }
    }

    /// A file that cannot be written.
    pub fn output(path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        move |source| Self::Output { path, source }
    }
}
