use pursuit_imaging::ImagingError;

/// What can be wrong with the parameters or images handed to the kernels of this crate.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum VisionError {
    /// A parameter outside of its range.
    #[error("{name} is {value}; it must be {range}")]
    Parameter {
        /// Name of the parameter.
        name: &'static str,
        /// What was given.
        value: f64,
        /// What is allowed.
        range: &'static str,
    },
    /// Two images that must be equally large are not.
    #[error(
        "{what} has {width}x{height} pixels where {expected_width}x{expected_height} were expected; resize it, or make a new value for the new size"
    )]
    SizeMismatch {
        /// Which image.
        what: &'static str,
        /// Its columns.
        width: usize,
        /// Its rows.
        height: usize,
        /// Columns expected.
        expected_width: usize,
        /// Rows expected.
        expected_height: usize,
    },
    /// An image that cannot be.
    #[error(transparent)]
    Imaging(#[from] ImagingError),
}

/// Refuses a parameter that is not in `least..=most` (or not a number).
pub(crate) fn require_range(
    name: &'static str,
    value: f64,
    (least, most): (f64, f64),
    range: &'static str,
) -> Result<(), VisionError> {
    if value >= least && value <= most { Ok(()) } else { Err(VisionError::Parameter { name, value, range }) }
}

/// Refuses an image that is not `expected` large.
pub(crate) fn require_size(
    what: &'static str,
    size: pursuit_geometry::Size,
    expected: pursuit_geometry::Size,
) -> Result<(), VisionError> {
    if size == expected {
        return Ok(());
    }
    Err(VisionError::SizeMismatch {
        what,
        width: size.width,
        height: size.height,
        expected_width: expected.width,
        expected_height: expected.height,
    })
}
