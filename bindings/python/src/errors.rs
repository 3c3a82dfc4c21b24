//! Errors of the crates below as Python exceptions of one hierarchy; the message is ours, one line.

use pursuit::RunError;
use pursuit::estimation::EstimationError;
use pursuit::imaging::ImagingError;
use pursuit::tracking::TrackingError;
use pyo3::create_exception;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;

create_exception!(pursuit, PursuitError, PyException, "What every error of pursuit is.");
create_exception!(pursuit, UsageError, PursuitError, "What was asked for makes no sense: a name, a parameter, a box.");
create_exception!(pursuit, InputError, PursuitError, "An input, or a frame of it, cannot be read or used.");
create_exception!(pursuit, OutputError, PursuitError, "A file cannot be written.");
create_exception!(
    pursuit,
    StateError,
    PursuitError,
    "A saved tracker cannot be restored, or a tracker was not started."
);
create_exception!(pursuit, ComputationError, PursuitError, "A computation on valid input failed.");

pub fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    module.add("PursuitError", py.get_type::<PursuitError>())?;
    module.add("UsageError", py.get_type::<UsageError>())?;
    module.add("InputError", py.get_type::<InputError>())?;
    module.add("OutputError", py.get_type::<OutputError>())?;
    module.add("StateError", py.get_type::<StateError>())?;
    module.add("ComputationError", py.get_type::<ComputationError>())
}

/// Wrong usage, in words.
pub fn usage(message: impl Into<String>) -> PyErr {
    UsageError::new_err(message.into())
}

/// The exception for what went wrong in a run.
pub fn of_run(error: &RunError) -> PyErr {
    let message = error.to_string();
    if let RunError::Tracking(TrackingError::Snapshot { .. }) = error {
        return StateError::new_err(message);
    }
    match error.exit_code() {
        2 => UsageError::new_err(message),
        3 => InputError::new_err(message),
        4 => OutputError::new_err(message),
        _ => ComputationError::new_err(message),
    }
}

/// The exception for what a tracker or a detector refuses.
pub fn of_tracking(error: TrackingError) -> PyErr {
    of_run(&error.into())
}

/// The exception for what a filter refuses: its matrices and numbers come from the caller.
pub fn of_estimation(error: EstimationError) -> PyErr {
    match error {
        EstimationError::Overflow { .. } | EstimationError::SingularInnovation { .. } => {
            ComputationError::new_err(error.to_string())
        }
        _ => UsageError::new_err(error.to_string()),
    }
}

/// The exception for pixels that make no image.
pub fn of_imaging(error: &ImagingError) -> PyErr {
    InputError::new_err(error.to_string())
}
