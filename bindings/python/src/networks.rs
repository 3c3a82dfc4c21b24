//! Where the library is that runs networks by file: that of the package `onnxruntime` of the Python that runs.

use pursuit::inference::onnx::find_library;
use pursuit::networks;
use pursuit::toml::Table;
use pyo3::prelude::*;
use std::path::PathBuf;

/// As for the command: names the library, or the folder it is in.
const VARIABLE: &str = "PURSUIT_ONNXRUNTIME";

/// `parameters` with the library named to whoever runs a network by file, unless they name one.
#[allow(clippy::disallowed_methods, reason = "a program is told by the environment where a library is")]
pub fn located<'a>(
    py: Python<'_>,
    parameters: Table,
    trackers: impl Iterator<Item = &'a str>,
    detector: Option<&str>,
) -> Table {
    let named = || std::env::var_os(VARIABLE).filter(|v| !v.is_empty()).map(PathBuf::from);
    networks::located(parameters, trackers, detector, || named().or_else(|| of_package(py)))
}

/// That of the package, which is looked for and not imported.
fn of_package(py: Python<'_>) -> Option<PathBuf> {
    let found = py.import("importlib.util").ok()?.call_method1("find_spec", ("onnxruntime",)).ok()?;
    let folders: Vec<PathBuf> = found.getattr("submodule_search_locations").ok()?.extract().ok()?;
    folders.iter().find_map(|folder| find_library(Some(&folder.join("capi")), &[]))
}
