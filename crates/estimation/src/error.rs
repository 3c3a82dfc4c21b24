//! The one error type of the crate.

use thiserror::Error;

/// What can go wrong in a filter. Whatever the variant, the belief the call was made on is left exactly as it was.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum EstimationError {
    /// A number that came in must be finite and is not.
    #[error(
        "{what} is NaN or infinite; leave out the step (a missing measurement is no update call) or mend the source"
    )]
    NotFinite {
        /// The quantity at fault.
        what: &'static str,
    },
    /// A result is too large for a floating point number, although what came in was finite.
    #[error("{what} overflowed; check the units, the time step and the process noise, or start again")]
    Overflow {
        /// The quantity at fault.
        what: &'static str,
    },
    /// Nothing that is believed possible explains a measurement: the target is lost, not the arithmetic.
    #[error(
        "the measurement is impossible under every {hypothesis}; the target is not where it is believed to be: start again from a detection, or widen the motion noise"
    )]
    Impossible {
        /// "particle" or "mode".
        hypothesis: &'static str,
    },
    /// A matrix that must be inverted has no inverse.
    #[error("{what} has no inverse; it sends different states to the same one, so that nothing can be said backwards")]
    NotInvertible {
        /// The matrix at fault.
        what: &'static str,
    },
    /// An index that is not below the length it points into.
    #[error("{what} {index} does not exist: indices are 0-based and below {length}")]
    Index {
        /// What is counted.
        what: &'static str,
        /// The index given.
        index: usize,
        /// How many there are.
        length: usize,
    },
    /// A covariance or noise matrix is not symmetric.
    #[error(
        "{what} is not symmetric: entries ({row}, {column}) and ({column}, {row}) differ; average the two before handing it over"
    )]
    NotSymmetric {
        /// The matrix at fault.
        what: &'static str,
        /// Row of the first entry that differs from its mirror image, 0-based.
        row: usize,
        /// Column of that entry, 0-based.
        column: usize,
    },
    /// A matrix that must be positive (semi-)definite is not.
    #[error(
        "{what} is not {requirement}: the pivot of row {row} is {pivot:e}; check signs and units of that component's variance"
    )]
    NotPositive {
        /// The matrix at fault.
        what: &'static str,
        /// "positive definite" or "positive semi-definite".
        requirement: &'static str,
        /// Row of the pivot that fails, 0-based.
        row: usize,
        /// Its value.
        pivot: f64,
    },
    /// A time step that is zero, negative or not finite.
    #[error("the time step must be a positive number of seconds, but it is {dt_s}; check the order of the time stamps")]
    TimeStep {
        /// The step given, in seconds.
        dt_s: f64,
    },
    /// The innovation covariance `S = H P Hᵀ + R` cannot be inverted.
    #[error(
        "the innovation covariance is singular (pivot {pivot:e} in row {row}); give that component of the measurement some noise"
    )]
    SingularInnovation {
        /// Row of the pivot that fails, 0-based.
        row: usize,
        /// Its value, in the units of the covariance.
        pivot: f64,
    },
    /// A parameter outside its range.
    #[error("{name} = {value} is out of range: it must be {expected}")]
    Parameter {
        /// The parameter's name.
        name: &'static str,
        /// The value given.
        value: f64,
        /// What would be accepted, in words.
        expected: &'static str,
    },
    /// Two inputs whose lengths must agree do not, or too few samples were given.
    #[error("{what}: got {got} where {expected} is needed")]
    Length {
        /// Which input.
        what: &'static str,
        /// The length given.
        got: usize,
        /// The length needed.
        expected: usize,
    },
    /// More cases than may be looked at.
    #[error(
        "there are too many {what} to look at; narrow the gate, raise the limit, or take a method that does not enumerate them"
    )]
    TooMany {
        /// What is counted.
        what: &'static str,
    },
    /// What is given as possible at once is not.
    #[error("{what} have a detection in common; each detection is of one target at most")]
    Incompatible {
        /// What cannot be together.
        what: &'static str,
    },
    /// An iteration did not settle.
    #[error(
        "{what} did not converge in {iterations} iterations; check that the model is detectable from its measurements"
    )]
    NoConvergence {
        /// The computation at fault.
        what: &'static str,
        /// Iterations made.
        iterations: usize,
    },
}

/// The result of a computation of this crate.
pub type Result<T> = std::result::Result<T, EstimationError>;

/// Refuses a value that is not finite or does not satisfy `holds`.
#[inline]
pub(crate) fn require(name: &'static str, value: f64, holds: bool, expected: &'static str) -> Result<()> {
    if value.is_finite() && holds { Ok(()) } else { Err(EstimationError::Parameter { name, value, expected }) }
}

/// Refuses a time step that is not a positive finite number of seconds.
#[inline]
pub(crate) fn require_time_step(dt_s: f64) -> Result<()> {
    if dt_s.is_finite() && dt_s > 0.0 { Ok(()) } else { Err(EstimationError::TimeStep { dt_s }) }
}
