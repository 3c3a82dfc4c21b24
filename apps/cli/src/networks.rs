//! Where the library is that runs networks which come as files: the environment's business, so this program's and no
//! library's.

use pursuit::inference::onnx::find_library;
use pursuit::parameters::{Parameter, merge, nested};
use pursuit::toml::Table;
use pursuit::trackers::registry;
use std::path::{Path, PathBuf};

/// Names the library, or the folder it is in.
const VARIABLE: &str = "PURSUIT_ONNXRUNTIME";
const GROUP: &str = "runtime";
const KEY: &str = "onnxruntime";

/// `parameters` with the onnxruntime of this machine named to whoever of the trackers, the detector and what says what detections look
/// like runs a network by file, unless the user named one.
#[allow(clippy::disallowed_methods, reason = "the command is told by the environment where a library is")]
pub fn located<'a>(parameters: Table, trackers: impl Iterator<Item = &'a str>, detector: Option<&str>) -> Table {
    let runs = |schema: &[Parameter]| schema.iter().any(|p| p.name == GROUP);
    let takes_part =
        trackers.filter_map(|name| registry::tracker(name).ok()).any(|t| runs(&t.default_recipe().schema()))
            || detector.and_then(|name| registry::detector(name).ok()).is_some_and(|d| runs(&d.schema()));
    let given = nested(&parameters);
    let embeds = ["many", "embedding"].iter().try_fold(&given, |table, key| table.get(*key)?.as_table());
    let embeds = embeds.is_some_and(|e| e.get("model").and_then(|m| m.as_str()) == Some("network"));
    if !cfg!(feature = "onnxruntime") || !(takes_part || embeds) {
        return parameters;
    }
    let named = std::env::var_os(VARIABLE).filter(|v| !v.is_empty()).map(PathBuf::from);
    let Some(library) = named.or_else(|| find_library(None, &package_folders())) else { return parameters };
    let library = library.to_string_lossy().into_owned();
    let places = [(takes_part, format!("{GROUP}.{KEY}")), (embeds, format!("many.embedding.network.{KEY}"))];
    let asked = places.into_iter().filter(|(asked, _)| *asked).map(|(_, place)| (place, library.clone().into()));
    let mut all = nested(&Table::from_iter(asked));
    merge(&mut all, given);
    all
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
