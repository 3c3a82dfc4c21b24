//! The one error type of the crate.

/// What can go wrong in measuring. Each message says what was wrong, where, and what would mend it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeasuringError {
    /// A unit of length that there is not.
    #[error("there is no unit `{given}`; use one of {}", crate::units::names())]
    Unit {
        /// The word given.
        given: String,
    },
    /// A length that cannot be read.
    #[error(
        "`{given}` is not a length; give a number above 0 and a unit, for example 0.50m, or 0.50m+-1mm with its uncertainty"
    )]
    Length {
        /// The text given.
        given: String,
    },
    /// A ruler that nothing can be measured with.
    #[error("{0}")]
    Ruler(String),
    /// A calibration that contradicts itself or the run.
    #[error("{0}")]
    Calibration(String),
    /// A camera file that cannot be used.
    #[error("{0}")]
    Camera(String),
    /// A track that nothing can be said of.
    #[error("{0}")]
    Track(String),
    /// Something asked for that makes no sense.
    #[error("{0}")]
    Option(String),
    /// The smoother failed.
    #[error("the motion of target {target} cannot be smoothed: {source}")]
    Smoothing {
        /// The target.
        target: u64,
        /// Why.
        source: pursuit_estimation::EstimationError,
    },
}

/// The result of a computation of this crate.
pub type Result<T> = std::result::Result<T, MeasuringError>;
