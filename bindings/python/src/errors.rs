//! Errors of the crates below as Python exceptions of one hierarchy; the message is ours, one line.

use pursuit::RunError;
use pursuit::estimation::EstimationError;
use pursuit::imaging::ImagingError;
use pursuit::tracking::TrackingError;
use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyUserWarning};
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

/// Says each note as a warning of Python's.
pub fn warn(py: Python<'_>, notes: &[String]) -> PyResult<()> {
    notes.iter().try_for_each(|note| {
        let text = std::ffi::CString::new(note.replace('\0', " ")).map_err(|e| usage(e.to_string()))?;
        PyErr::warn(py, &py.get_type::<PyUserWarning>(), &text, 1)
    })
}

/// The exception for what went wrong in a run.
pub fn of_run(error: &RunError) -> PyErr {
    let message = in_python(&error.to_string());
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

/// A message with the command's options as the keywords that they are here: `--detect ball` is `detect="ball"`.
fn in_python(message: &str) -> String {
    let mut out = String::with_capacity(message.len());
    for (i, part) in message.split('`').enumerate() {
        if i > 0 {
            out.push('`');
        }
        match part.strip_prefix("--").filter(|_| i % 2 == 1) {
            Some(option) => out += &keyword(option),
            None => out += part,
        }
    }
    out.replace("(reinit)", "(`init`)")
}

/// An option with its value, where it has one, as a keyword with its argument.
fn keyword(option: &str) -> String {
    let (name, value) = option.split_once(' ').map_or((option, None), |(name, value)| (name, Some(value)));
    let (name, value) = match (name, value) {
        // Boxes are drawn in the browser by the command alone.
        ("pick" | "watch", _) => return format!("pursuit track --{option}"),
        ("set", Some(setting)) => match setting.split_once('=') {
            Some((key, value)) => (key.replace('.', "__"), Some(value)),
            None => return "KEY=VALUE".to_owned(),
        },
        ("from", value) => ("start".to_owned(), value),
        ("to", value) => ("end".to_owned(), value),
        ("format", value) => ("formats".to_owned(), value),
        (name, None) if name.starts_with("no-") => return format!("{}=False", name[3..].replace('-', "_")),
        (name, value) => (name.replace('-', "_"), value),
    };
    let is_placeholder = |text: &str| text.chars().all(|c| c.is_ascii_uppercase() || ",=_".contains(c));
    match value {
        None => format!("{name}=True"),
        Some(text) if is_placeholder(text) && text.contains(',') => {
            format!("{name}=({})", text.to_ascii_lowercase().replace(',', ", "))
        }
        Some(text) if is_placeholder(text) || text.parse::<f64>().is_ok() => format!("{name}={text}"),
        Some(text) => format!("{name}=\"{text}\""),
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
