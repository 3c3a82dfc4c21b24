//! Where the onnxruntime library is.

use std::path::{Path, PathBuf};

/// Folders where systems put libraries and Python packages.
const SYSTEM: &[&str] = &[
    "/usr/local/lib",
    "/usr/lib",
    "/usr/lib64",
    "/usr/lib/x86_64-linux-gnu",
    "/usr/lib/aarch64-linux-gnu",
    "/opt/homebrew/lib",
    "/usr/lib/python3/dist-packages",
];

/// The file of the onnxruntime library: the one named, or the first in the folders of Python packages, or the system's.
pub fn find_library(named: Option<&Path>, package_folders: &[PathBuf]) -> Option<PathBuf> {
    if let Some(named) = named {
        return if named.is_dir() { in_folder(named) } else { named.is_file().then(|| named.to_owned()) };
    }
    package_folders.iter().map(PathBuf::as_path).chain(SYSTEM.iter().map(Path::new)).find_map(in_folder)
}

/// The library in a folder, or in the package that lies in it.
fn in_folder(folder: &Path) -> Option<PathBuf> {
    let is_library = |name: &str| {
        name.starts_with("libonnxruntime.so")
            || (name.starts_with("libonnxruntime.") && name.ends_with(".dylib"))
            || name == "onnxruntime.dll"
    };
    [folder.to_owned(), folder.join("onnxruntime/capi")].iter().find_map(|folder| {
        let files = std::fs::read_dir(folder).ok()?.filter_map(|e| Some(e.ok()?.path()));
        let mut libraries: Vec<PathBuf> =
            files.filter(|p| p.file_name().and_then(|n| n.to_str()).is_some_and(is_library)).collect();
        // The longest name has the most of the version in it: the others are links to it.
        libraries.sort_by_key(|p| (p.as_os_str().len(), p.clone()));
        libraries.pop()
    })
}
