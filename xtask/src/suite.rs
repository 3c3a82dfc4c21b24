//! `cargo xtask test`: everything that must hold before a change lands.

use crate::{api, browser, features, fuzz, layers, licences, notices, peers, release, run, soak, wheel};
use anyhow::{Context, Result};
use std::time::{Duration, Instant};

/// Seconds of the short form of `cargo xtask soak`.
const SOAK_SECONDS: u32 = 30;

/// All checks, the cheap ones first; stops at the first that fails.
pub fn test(quick: bool, fuzz_seconds: u32) -> Result<()> {
    let (mut skipped, mut clock) = (Vec::new(), Clock::default());
    clock.time("format", || format(&mut skipped))?;
    clock.time("floors", layers::check)?;
    clock.time("lock files", fuzz::check_lock)?;
    clock.time("lints", || lints(&mut skipped))?;
    clock.time("licences", licences::check)?;
    clock.time("notices", notices::check)?;
    clock.time("documentation", docs)?;
    clock.time("features", features::check)?;
    clock.time("broker", || crate::broker::install_or_skip(&mut skipped))?;
    clock.time("tests", || run::workspace("test").arg("--no-fail-fast").run())?;
    if quick {
        skipped.push(
            "the release suite, fuzzing, the Python wheel and the comparisons with independent tools (--quick)".into(),
        );
    } else {
        clock.time("release suite", release::test)?;
        if cfg!(target_os = "linux") {
            clock.time("soak", || soak::run(SOAK_SECONDS))?;
        }
        clock.time("fuzzing", || fuzzing(fuzz_seconds, &mut skipped))?;
        clock.time("browser", || browser::test_or_skip(&mut skipped))?;
        clock.time("made-up requests", || api::test_or_skip(&mut skipped))?;
        clock.time("wheel", || wheel::make_or_skip(&mut skipped))?;
        clock.time("comparisons", || peers::compare_or_skip(&mut skipped))?;
    }
    report(&skipped, &clock);
    Ok(())
}

/// How long each check took.
#[derive(Default)]
struct Clock(Vec<(&'static str, Duration)>);

impl Clock {
    fn time(&mut self, what: &'static str, check: impl FnOnce() -> Result<()>) -> Result<()> {
        let start = Instant::now();
        let result = check();
        self.0.push((what, start.elapsed()));
        result.with_context(|| format!("{what}, after {self}"))
    }
}

impl std::fmt::Display for Clock {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let words: Vec<String> = self.0.iter().map(|(what, took)| format!("{what} {} s", took.as_secs())).collect();
        write!(f, "{}", words.join(", "))
    }
}

/// Builds the documentation, with broken links and missing pieces as errors.
pub fn docs() -> Result<()> {
    run::suite("doc").args(["--workspace", "--no-deps"]).env("RUSTDOCFLAGS", "-D warnings").run()
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
    run::workspace("clippy").args(["--all-targets", "--", "-D", "warnings"]).run()
}

fn fuzzing(seconds: u32, skipped: &mut Vec<String>) -> Result<()> {
    let compiler = std::env::var_os("CXX").unwrap_or_else(|| "c++".into());
    if !run::program(compiler).arg("--version").works() {
        skipped.push("fuzzing: there is no C++ compiler".into());
        return Ok(());
    }
    fuzz::run(seconds, None)
}

fn report(skipped: &[String], clock: &Clock) {
    println!("\n{clock}");
    if skipped.is_empty() {
        println!(
            "Everything passed; nothing was skipped by cargo xtask. Tests that lack real footage say `skipped:` themselves."
        );
    } else {
        println!("Everything that could be run passed. Skipped:");
        skipped.iter().for_each(|s| println!("  - {s}"));
    }
}
