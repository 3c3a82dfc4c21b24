//! The studio's page in a real browser.

use crate::run;
use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};

/// Where the tests lie, and what they need from npm.
const TESTS: &str = "apps/studio/browser";

/// Checks the types of the page's scripts and uses the page as a user would; where there is no Node or no Chromium, and
/// none can be installed, that is said instead.
pub fn test_or_skip(skipped: &mut Vec<String>) -> Result<()> {
    match prepare() {
        Ok((folder, browser)) => test(&folder, &browser),
        Err(why) => {
            skipped.push(format!("the studio in a browser: {why:#}"));
            Ok(())
        }
    }
}

/// The same, failing where something is missing.
pub fn test_or_fail() -> Result<()> {
    let (folder, browser) = prepare()?;
    test(&folder, &browser)
}

fn test(folder: &Path, browser: &Path) -> Result<()> {
    let types = run::program("node").arg(folder.join("node_modules/typescript/bin/tsc")).arg("--project");
    types.arg(run::root().join(TESTS).join("tsconfig.json")).run()?;
    run::build_programs()?;
    let pursuit = run::product("pursuit")?;
    let pictures = std::path::absolute(run::target_dir().join("browser-pictures"))?;
    let script = run::program("node").arg(folder.join("studio.test.mjs"));
    script.arg(pursuit).arg(browser).arg(&pictures).run()?;
    println!("pictures of the page: {}", pictures.display());
    Ok(())
}

/// The tests with everything they need, in `target/browser`, and a Chromium.
fn prepare() -> Result<(PathBuf, PathBuf)> {
    let node = || ["node", "npm"].iter().all(|name| run::program(name).arg("--version").works());
    if !(node() || install(&["nodejs", "npm"]) && node()) {
        bail!("there is no Node.js and none can be installed; install `nodejs` and `npm`");
    }
    let browser = chromium()?;
    let folder = std::path::absolute(run::target_dir().join("browser"))?;
    std::fs::create_dir_all(&folder)?;
    let tests = run::root().join(TESTS);
    for entry in std::fs::read_dir(&tests)? {
        let entry = entry?;
        if entry.file_type()?.is_file() {
            std::fs::copy(entry.path(), folder.join(entry.file_name()))?;
        }
    }
    let (wanted, stamp) = (std::fs::read(tests.join("package.json"))?, folder.join("installed"));
    if std::fs::read(&stamp).ok().as_ref() != Some(&wanted) {
        let npm = run::program("npm").args(["install", "--no-audit", "--no-fund", "--prefix"]).arg(&folder);
        npm.run().context("npm cannot install what the tests need")?;
        std::fs::write(stamp, wanted)?;
    }
    Ok((folder, browser))
}

/// The Chromium on the path; on Debian installed where there is none.
fn chromium() -> Result<PathBuf> {
    let found = || {
        let path = std::env::var_os("PATH").unwrap_or_default();
        let names = ["chromium", "chromium-browser", "google-chrome"];
        std::env::split_paths(&path).flat_map(|d| names.map(|n| d.join(n))).find(|p| p.is_file())
    };
    if let Some(browser) = found() {
        return Ok(browser);
    }
    install(&["chromium"]);
    found().context("there is no Chromium and none can be installed; install `chromium`")
}

/// Installs packages of Debian, which takes the superuser; whether that worked.
pub fn install(packages: &[&str]) -> bool {
    let apt = |arguments: &[&str]| run::program("apt-get").args(arguments).env("DEBIAN_FRONTEND", "noninteractive");
    apt(&["update"]).works() && apt(&["install", "--yes", "--no-install-recommends"]).args(packages).works()
}
