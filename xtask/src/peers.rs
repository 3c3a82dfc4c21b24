//! Comparisons with independent tools, in Python: each `xtask/peers/check_*.py` runs our program or reads our fixtures
//! and an independent implementation side by side, and exits non-zero when they disagree.

use crate::run;
use anyhow::{Context, Result};
use std::path::PathBuf;

/// Installs what the comparisons need into `target/peers` and runs them all.
pub fn compare() -> Result<()> {
    let python = environment()?;
    run_all(&python)
}

/// As [`compare`], but a machine without Python or without access to its packages is no failure: it is said.
pub fn compare_or_skip(skipped: &mut Vec<String>) -> Result<()> {
    match environment() {
        Ok(python) => run_all(&python),
        Err(why) => {
            skipped.push(format!("the comparisons with independent tools: {why:#}"));
            Ok(())
        }
    }
}

/// The Python of a virtual environment with everything in `xtask/peers/requirements.txt`.
fn environment() -> Result<PathBuf> {
    let folder = run::target_dir().join("peers");
    let python = folder.join("bin/python");
    let requirements = run::root().join("xtask/peers/requirements.txt");
    let wanted = std::fs::read(&requirements)?;
    let stamp = folder.join("installed");
    if std::fs::read(&stamp).is_ok_and(|installed| installed == wanted) {
        return Ok(python);
    }
    if !python.exists() {
        if !run::program("python3").args(["-c", "import venv, ensurepip"]).works() && is_debian_like() {
            run::program("apt-get").args(["install", "-y", "-q", "python3-venv"]).run()?;
        }
        run::program("python3").args(["-m", "venv"]).arg(&folder).run().context("no usable python3")?;
    }
    run::program(&python)
        .args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "-r"])
        .arg(&requirements)
        .run()
        .context("their packages cannot be installed")?;
    std::fs::write(stamp, wanted)?;
    Ok(python)
}

fn is_debian_like() -> bool {
    run::program("apt-get").arg("--version").works()
}

fn run_all(python: &PathBuf) -> Result<()> {
    decoding_through_ffmpeg(python)?;
    let mut scripts: Vec<PathBuf> = std::fs::read_dir(run::root().join("xtask/peers"))?
        .filter_map(|e| Some(e.ok()?.path()))
        .filter(|p| {
            p.file_name().and_then(|n| n.to_str()).is_some_and(|n| n.starts_with("check_") && n.ends_with(".py"))
        })
        .collect();
    scripts.sort();
    for script in scripts {
        run::program(python)
            .arg(script)
            .env("PURSUIT", run::target_dir().join("release/pursuit"))
            .env("OPENBLAS_NUM_THREADS", "1")
            .run()?;
    }
    Ok(())
}

/// The tests of the path through an `ffmpeg` process, with the one that comes as a Python package.
fn decoding_through_ffmpeg(python: &PathBuf) -> Result<()> {
    let ask =
        run::program(python).args(["-c", "import imageio_ffmpeg; print(imageio_ffmpeg.get_ffmpeg_exe(), end='')"]);
    let ffmpeg = String::from_utf8(ask.output()?)?;
    run::cargo("test")
        .args(["--locked", "--package", "pursuit-media", "--test", "ffmpeg"])
        .env("PURSUIT_TEST_FFMPEG", ffmpeg)
        .run()
}
