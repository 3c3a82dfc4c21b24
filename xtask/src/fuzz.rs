//! Fuzzing without any installed tool: the targets under `fuzz/` are built with the compiler's coverage passes and linked
//! with libFuzzer, which comes as a crate.

use crate::run;
use anyhow::{Context, Result, bail};

/// What the compiler needs so that libFuzzer sees which branches an input reaches.
const COVERAGE: &str = "--cfg fuzzing -Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
    -Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table \
    -Cllvm-args=-sanitizer-coverage-trace-compares -Ccodegen-units=1 -Cdebug-assertions -Coverflow-checks";

/// Runs every target (or the one named) for `seconds`; a crash is an error, and its input stays under `fuzz/artifacts`.
pub fn run(seconds: u32, only: Option<&str>) -> Result<()> {
    let targets = targets()?;
    let chosen: Vec<_> = targets.iter().filter(|t| only.is_none_or(|o| o == t.as_str())).collect();
    if chosen.is_empty() {
        bail!("there is no such fuzz target; there are: {}", targets.join(", "));
    }
    let host = host()?;
    let target_dir = run::target_dir().join("fuzz");
    run::cargo("build")
        .args(["--release", "--locked", "--manifest-path", "fuzz/Cargo.toml", "--bins", "--target", &host])
        .env("RUSTFLAGS", COVERAGE)
        .env("CARGO_TARGET_DIR", &target_dir)
        .run()?;
    for target in chosen {
        let corpus = format!("fuzz/corpus/{target}");
        std::fs::create_dir_all(run::root().join(&corpus))?;
        std::fs::create_dir_all(run::root().join("fuzz/artifacts"))?;
        let seeds = format!("fuzz/seeds/{target}");
        let seeds = run::root().join(&seeds).is_dir().then_some(seeds);
        run::program(target_dir.join(&host).join("release").join(target))
            .arg(corpus)
            .args(seeds)
            .args([&format!("-max_total_time={seconds}"), "-rss_limit_mb=2048", "-timeout=10", "-max_len=65536"])
            .args(["-artifact_prefix=fuzz/artifacts/", "-print_final_stats=1", "-verbosity=0"])
            .run()?;
    }
    Ok(())
}

/// Whether every target compiles.
pub fn check() -> Result<()> {
    run::cargo("check")
        .args(["--locked", "--manifest-path", "fuzz/Cargo.toml", "--bins"])
        .env("CARGO_TARGET_DIR", run::target_dir().join("fuzz"))
        .run()
}

/// Whether the targets' lock file, which no build of the workspace looks at, names what they use.
pub fn check_lock() -> Result<()> {
    let arguments = ["--locked", "--format-version", "1", "--manifest-path", "fuzz/Cargo.toml"];
    run::cargo("metadata").args(arguments).output().map(drop).context(
        "fuzz/Cargo.lock is not up to date: `cargo metadata --format-version 1 --manifest-path fuzz/Cargo.toml` mends it",
    )
}

/// The names of the targets: one file each under `fuzz/fuzz_targets`.
fn targets() -> Result<Vec<String>> {
    let folder = run::root().join("fuzz/fuzz_targets");
    let entries = std::fs::read_dir(&folder).with_context(|| format!("cannot read {}", folder.display()))?;
    let mut names: Vec<String> =
        entries.filter_map(|e| e.ok()?.path().file_stem()?.to_str().map(str::to_owned)).collect();
    names.sort();
    Ok(names)
}

fn host() -> Result<String> {
    let version = String::from_utf8(run::program("rustc").arg("-vV").output()?)?;
    let line = version.lines().find_map(|l| l.strip_prefix("host: ")).context("rustc names no host")?;
    Ok(line.to_owned())
}
