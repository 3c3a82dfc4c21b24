//! The release suite: what would take too long unoptimised, whole runs of the program and experiments over hundreds of
//! seeds. Those tests are ignored otherwise, with a reason that begins with `release:`.

use crate::metadata::{self, Target};
use crate::run;
use anyhow::Result;
use std::path::Path;

/// Spelt so that this file does not hold it.
const MARK: &str = concat!("#[ignore = \"", "release");

/// Runs the marked tests, which the tests' own build holds.
pub fn test() -> Result<()> {
    let marked: Vec<Target> = metadata::targets()?.into_iter().filter(is_marked).collect();
    for kind in ["lib", "test"] {
        let those: Vec<&Target> = marked.iter().filter(|t| t.kind == kind).collect();
        let mut step = run::workspace("test");
        step = match kind {
            "lib" => step.arg("--lib"),
            _ => those.iter().fold(step, |step, target| step.args(["--test", target.name.as_str()])),
        };
        if !those.is_empty() {
            step.args(["--", "--ignored"]).run()?;
        }
    }
    Ok(())
}

/// Whether a source file of the target holds the mark.
fn is_marked(target: &Target) -> bool {
    let root = Path::new(&target.source);
    let own_folder = root.file_name().is_some_and(|n| n == "lib.rs" || n == "main.rs");
    match root.parent() {
        Some(folder) if own_folder => holds_mark(folder),
        _ => holds_mark(root),
    }
}

/// Looks into a file, or into all files below a folder.
fn holds_mark(path: &Path) -> bool {
    match std::fs::read_dir(path) {
        Ok(entries) => entries.flatten().any(|e| holds_mark(&e.path())),
        Err(_) => std::fs::read_to_string(path).is_ok_and(|text| text.contains(MARK)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With link-time optimisation everything in a program is optimised at the level of the crate that is linked last: with
    /// the command at `"s"` no loop ran on vectors, and the default tracker took five times as long.
    #[test]
    fn what_is_linked_last_is_optimised_in_full() {
        let manifest = std::fs::read_to_string(run::root().join("Cargo.toml")).unwrap();
        let release = manifest.split_once("[profile.release.package]").unwrap().1;
        let lines = release.lines().skip(1).take_while(|line| !line.starts_with('['));
        let ours: Vec<&str> = lines.filter(|line| line.starts_with("pursuit")).collect();
        assert_eq!(ours, [""; 0]);
    }

    #[test]
    fn marked_tests_are_found_where_they_are() {
        let marked: Vec<Target> = metadata::targets().unwrap().into_iter().filter(is_marked).collect();
        let found = |kind: &str, name: &str| marked.iter().any(|t| (t.kind.as_str(), t.name.as_str()) == (kind, name));
        assert!(found("test", "own_models"), "in a folder");
        assert!(found("test", "reproduce"), "in a file");
        assert!(found("lib", "pursuit_experiments"), "in a library");
        assert!(!found("test", "contract"));
        assert!(!found("bin", "xtask"), "the mark is looked for, and not held, here");
    }
}
