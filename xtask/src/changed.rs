//! The tests of the crates that a contributor has changed.

use crate::{metadata, run};
use anyhow::{Context, Result};
use std::collections::BTreeSet;

/// Tests the crates with a file that differs from where this branch left main, committed or not.
pub fn test() -> Result<()> {
    let changed = crates()?;
    if changed.is_empty() {
        println!("no crate differs from main");
        return Ok(());
    }
    let packages = changed.iter().flat_map(|name| ["--package", name.as_str()]);
    run::daily("test").arg("--no-fail-fast").args(packages).run()
}

fn crates() -> Result<BTreeSet<String>> {
    let git = |arguments: &[&str]| run::program("git").args(arguments).said();
    let base = ["origin/main", "main", "HEAD"].iter().find_map(|main| git(&["merge-base", "HEAD", main]));
    let base = base.context("git finds no commit to compare with")?;
    let differing = git(&["diff", "--name-only", "--relative", &base]).context("git cannot compare with main")?;
    let new = git(&["ls-files", "--others", "--exclude-standard"]).unwrap_or_default();
    let folders = metadata::folders()?;
    let files = differing.lines().chain(new.lines()).map(|file| run::root().join(file));
    let of =
        |file: std::path::PathBuf| folders.iter().find(|(_, folder)| file.starts_with(folder)).map(|f| f.0.clone());
    Ok(files.filter_map(of).collect())
}
