//! The release suite: what would take too long unoptimised, whole runs of the program and experiments over hundreds of
//! seeds. Those tests are ignored otherwise, with a reason that begins with `release:`; or with `whole:` where they take minutes.

use crate::metadata::{self, Target};
use crate::run;
use anyhow::Result;
use std::path::Path;

/// Spelt so that this file does not hold it.
pub const RELEASE: &str = concat!("#[ignore = \"", "release:");
/// As [`RELEASE`]; a test program holds one of both alone, because the reason cannot be chosen by when it is run.
pub const WHOLE: &str = concat!("#[ignore = \"", "whole:");

/// Runs the tests of one mark, which the tests' own build holds.
pub fn test(mark: &str) -> Result<()> {
    let marked: Vec<Target> = metadata::targets()?.into_iter().filter(|target| is_marked(target, mark)).collect();
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
fn is_marked(target: &Target, mark: &str) -> bool {
    let root = Path::new(&target.source);
    let own_folder = root.file_name().is_some_and(|n| n == "lib.rs" || n == "main.rs");
    match root.parent() {
        Some(folder) if own_folder => holds(folder, mark),
        _ => holds(root, mark),
    }
}

/// Looks into a file, or into all files below a folder.
fn holds(path: &Path, mark: &str) -> bool {
    match std::fs::read_dir(path) {
        Ok(entries) => entries.flatten().any(|e| holds(&e.path(), mark)),
        Err(_) => std::fs::read_to_string(path).is_ok_and(|text| text.contains(mark)),
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
        let targets = metadata::targets().unwrap();
        let holds = |kind: &str, name: &str, mark: &str| {
            targets.iter().any(|t| (t.kind.as_str(), t.name.as_str()) == (kind, name) && is_marked(t, mark))
        };
        let found = |kind: &str, name: &str| holds(kind, name, RELEASE);
        assert!(found("test", "own_models"), "in a folder");
        assert!(found("test", "reproduce"), "in a file");
        assert!(found("lib", "pursuit_experiments"), "in a library");
        assert!(!found("test", "contract"));
        assert!(!found("bin", "xtask"), "the mark is looked for, and not held, here");
        assert!(holds("test", "reproduce_in_full", WHOLE));
        let both = targets.iter().find(|t| is_marked(t, RELEASE) && is_marked(t, WHOLE));
        assert!(both.is_none(), "one mark a program: {}", both.unwrap().name);
    }
}
