//! Where the library is that runs networks which come as files: the environment's business, so this program's and no
//! library's.

use pursuit::inference::onnx::find_library;
use pursuit::networks;
use pursuit::toml::Table;
use std::path::{Path, PathBuf};

/// Names the library, or the folder it is in.
const VARIABLE: &str = "PURSUIT_ONNXRUNTIME";

/// `parameters` with the onnxruntime of this machine named to whoever of the trackers, the detector and what says what detections look
/// like runs a network by file, unless the user named one.
#[allow(clippy::disallowed_methods, reason = "the command is told by the environment where a library is")]
pub fn located<'a>(parameters: Table, trackers: impl Iterator<Item = &'a str>, detector: Option<&str>) -> Table {
    let named = || std::env::var_os(VARIABLE).filter(|v| !v.is_empty()).map(PathBuf::from);
    networks::located(parameters, trackers, detector, || named().or_else(|| find_library(None, &package_folders())))
}

/// Where the Python of an active environment, and that of the user, have their packages.
#[allow(clippy::disallowed_methods, reason = "the command is told by the environment where a library is")]
fn package_folders() -> Vec<PathBuf> {
    let of = |variable: &str, below: &str| std::env::var_os(variable).map(|v| Path::new(&v).join(below));
    let roots = [of("VIRTUAL_ENV", "lib"), of("CONDA_PREFIX", "lib"), of("HOME", ".local/lib")];
    let mut folders: Vec<PathBuf> = roots
        .into_iter()
        .flatten()
        .filter_map(|root| std::fs::read_dir(root).ok())
        .flat_map(|entries| entries.filter_map(|e| Some(e.ok()?.path())))
        .filter(|p| p.file_name().and_then(|n| n.to_str()).is_some_and(|n| n.starts_with("python")))
        .map(|python| python.join("site-packages"))
        .collect();
    folders.sort();
    folders
}
