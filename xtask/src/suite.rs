//! `cargo xtask test`: everything that must hold before a change lands.

use crate::{features, fuzz, layers, licences, notices, peers, run};
use anyhow::Result;

/// All checks, the cheap ones first; stops at the first that fails.
pub fn test(quick: bool, fuzz_seconds: u32) -> Result<()> {
    let mut skipped = Vec::new();
    format(&mut skipped)?;
    lints(&mut skipped)?;
    layers::check()?;
    licences::check()?;
    notices::check()?;
    docs()?;
    features::check()?;
    run::cargo("test").args(["--workspace", "--locked"]).run()?;
    if quick {
        skipped.push("the release suite, fuzzing and the comparisons with independent tools (--quick)".into());
    } else {
        release()?;
        fuzzing(fuzz_seconds, &mut skipped)?;
        peers::compare_or_skip(&mut skipped)?;
    }
    report(&skipped);
    Ok(())
}

/// Builds the documentation, with broken links and missing pieces as errors.
pub fn docs() -> Result<()> {
    run::cargo("doc").args(["--workspace", "--no-deps", "--locked"]).env("RUSTDOCFLAGS", "-D warnings").run()
}

fn format(skipped: &mut Vec<String>) -> Result<()> {
    if !run::cargo("fmt").arg("--version").works() {
        skipped.push("the format check: rustfmt is not installed".into());
        return Ok(());
    }
    run::cargo("fmt").args(["--all", "--check"]).run()
}

fn lints(skipped: &mut Vec<String>) -> Result<()> {
    if !run::cargo("clippy").arg("--version").works() {
        skipped.push("the lints: clippy is not installed".into());
        return Ok(());
    }
    run::cargo("clippy").args(["--workspace", "--all-targets", "--locked", "--", "-D", "warnings"]).run()
}

/// What would take too long unoptimised: whole runs of the program, and experiments over hundreds of seeds. Those tests
/// are marked `#[ignore = "release: …"]`.
///
/// Linking every test program with optimisation across crates would take longer than the tests; it changes no result.
fn release() -> Result<()> {
    let cargo = |subcommand| run::cargo(subcommand).env("CARGO_PROFILE_RELEASE_LTO", "off");
    cargo("build").args(["--release", "--locked", "--package", "pursuit-cli"]).run()?;
    cargo("test").args(["--workspace", "--release", "--locked", "--tests", "--", "--ignored"]).run()
}

fn fuzzing(seconds: u32, skipped: &mut Vec<String>) -> Result<()> {
    let compiler = std::env::var_os("CXX").unwrap_or_else(|| "c++".into());
    if !run::program(compiler).arg("--version").works() {
        skipped.push("fuzzing: there is no C++ compiler".into());
        return Ok(());
    }
    fuzz::run(seconds, None)
}

fn report(skipped: &[String]) {
    println!();
    if skipped.is_empty() {
        println!(
            "Everything passed; nothing was skipped by cargo xtask. Tests that lack real footage say `skipped:` themselves."
        );
    } else {
        println!("Everything that could be run passed. Skipped:");
        skipped.iter().for_each(|s| println!("  - {s}"));
    }
}
