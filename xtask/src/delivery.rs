//! What users are handed besides the program, as far as it can be looked at without building it: the workflows by the schema of
//! their makers, the Dockerfile by hadolint.

use crate::needs::{self, Need};
use crate::{peers, run};
use anyhow::{Context, Result};
use std::path::PathBuf;

/// What looks at it.
pub const NEEDS: [&Need; 2] = [&needs::PYTHON, &needs::DELIVERY];

/// Looks at all of it, where Python and its packages can be had.
pub fn check_or_skip(skipped: &mut Vec<String>) -> Result<()> {
    match peers::environment("peers-delivery", "delivery.txt") {
        Ok(python) => check(&python),
        Err(why) => {
            skipped.push(format!("workflows and Dockerfile: {why:#}"));
            Ok(())
        }
    }
}

fn check(python: &std::path::Path) -> Result<()> {
    let schema = ["-m", "check_jsonschema", "--builtin-schema", "vendor.github-workflows"];
    run::program(python).args(schema).args(workflows()?).run()?;
    let hadolint = python.with_file_name("hadolint");
    run::program(hadolint).arg(run::root().join("Dockerfile")).run()
}

fn workflows() -> Result<Vec<PathBuf>> {
    let folder = run::root().join(".github/workflows");
    let mut files: Vec<PathBuf> = std::fs::read_dir(&folder)
        .with_context(|| folder.display().to_string())?
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.extension().is_some_and(|e| e == "yml"))
        .collect();
    files.sort();
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(name: &str) -> String {
        std::fs::read_to_string(run::root().join(name)).unwrap()
    }

    #[test]
    fn a_release_has_wheels_for_all_systems_and_their_sources() {
        let release = text(".github/workflows/release.yml");
        for (target, system) in
            [("x86_64", "2_28"), ("aarch64", "2_28"), ("x86_64", "musllinux_1_2"), ("aarch64", "musllinux_1_2")]
        {
            let wanted = format!("target: {target}, manylinux: \"{system}\"");
            assert!(release.contains(&wanted), "{wanted}");
        }
        assert!(release.contains("command: sdist") && release.contains("needs: [command, wheel, sdist]"));
        assert_eq!(workflows().unwrap().len(), 2);
    }

    #[test]
    fn the_image_is_built_of_what_the_build_reads() {
        let (docker, ignored) = (text("Dockerfile"), text(".dockerignore"));
        let version = text("Cargo.toml");
        let (_, version) = version.split_once("rust-version = \"").unwrap();
        let version = version.split('"').next().unwrap();
        assert!(docker.contains(&format!("FROM rust:{version}-slim")), "an older Rust than {version}, or a newer");
        let sent: Vec<&str> = ignored.lines().filter_map(|line| line.strip_prefix('!')).collect();
        for name in &sent {
            assert!(run::root().join(name).exists(), "{name}");
        }
        // Every folder of the workspace has to be there for cargo to read it, also where nothing of it is built.
        let manifest = text("Cargo.toml");
        let members = manifest.lines().find_map(|line| line.strip_prefix("members = ")).unwrap();
        for member in members.split('"').skip(1).step_by(2) {
            let top = member.split('/').next().unwrap();
            assert!(sent.contains(&top), "{top} is a member of the workspace and not sent");
        }
        // A pattern for folders at any depth may meet one of the sources: `target` is also what is followed.
        let kept_back: Vec<&str> = ignored.lines().filter_map(|line| line.strip_prefix("**/")).collect();
        assert!(!kept_back.is_empty());
        // Of an archive of the sources nothing is listed.
        let listed = run::program("git").args(["ls-files"]).output().unwrap_or_default();
        let listed = String::from_utf8(listed).unwrap();
        for file in listed.lines().filter(|file| sent.contains(&file.split('/').next().unwrap())) {
            assert!(!file.split('/').any(|part| kept_back.contains(&part)), "{file} is not sent");
        }
        for copied in docker.lines().filter_map(|line| line.strip_prefix("COPY --from=build ")) {
            for file in copied.split(' ').filter_map(|word| word.strip_prefix("/source/")) {
                assert!(file.starts_with("target/") || run::root().join(file).is_file(), "{file}");
                let top = file.split('/').next().unwrap();
                assert!(file.starts_with("target/") || sent.contains(&top), "{top} is not sent");
            }
        }
    }
}
