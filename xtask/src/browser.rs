//! The studio's page in a real browser.

use crate::needs::{self, Need};
use crate::run;
use anyhow::{Context, Result};
use std::path::PathBuf;

/// Where the tests lie, and what they need from npm.
const TESTS: &str = "apps/studio/browser";

/// What the tests run with.
struct Tools {
    node: PathBuf,
    chromium: PathBuf,
    folder: PathBuf,
}

/// Checks the types of the page's scripts and uses the page as a user would; where npm has no packages for it, that is
/// said instead.
pub fn test_or_skip(skipped: &mut Vec<String>) -> Result<()> {
    match prepare() {
        Ok(tools) => test(&tools),
        Err(why) => {
            skipped.push(format!("the studio in a browser: {why:#}"));
            Ok(())
        }
    }
}

/// The same, failing where something is missing that cannot be installed.
pub fn test_or_fail() -> Result<()> {
    needs::bring_all(&NEEDS)?;
    test(&prepare()?)
}

fn test(tools: &Tools) -> Result<()> {
    let types = run::program(&tools.node).arg(tools.folder.join("node_modules/typescript/bin/tsc")).arg("--project");
    types.arg(run::root().join(TESTS).join("tsconfig.json")).run()?;
    run::build_programs()?;
    let pursuit = run::product("pursuit")?;
    let pictures = std::path::absolute(run::target_dir().join("browser-pictures"))?;
    let script = run::program(&tools.node).arg(tools.folder.join("studio.test.mjs"));
    script.arg(pursuit).arg(&tools.chromium).arg(&pictures).run()?;
    println!("pictures of the page: {}", pictures.display());
    Ok(())
}

/// What they need; the first two are packages of Debian.
pub const NEEDS: [&Need; 4] = [&needs::NPM, &needs::CHROMIUM, &needs::NODE, &needs::PLAYWRIGHT];

/// What playwright-core asks for.
const OLDEST_NODE: u32 = 20;
/// What is taken from npm where the machine's is older: Debian 12 has 18.
const NODE: &str = "node@22";

/// Where the tests run, with what they need of npm.
fn folder() -> PathBuf {
    run::target_dir().join("browser")
}

/// The tests with everything they need, in `target/browser`, Node.js and a Chromium.
fn prepare() -> Result<Tools> {
    let folder = std::path::absolute(folder())?;
    std::fs::create_dir_all(&folder)?;
    let tests = run::root().join(TESTS);
    for entry in std::fs::read_dir(&tests)? {
        let entry = entry?;
        if entry.file_type()?.is_file() {
            std::fs::copy(entry.path(), folder.join(entry.file_name()))?;
        }
    }
    let npm = |arguments: &[&str]| {
        let npm = run::program("npm").args(["install", "--no-audit", "--no-fund", "--prefix"]).arg(&folder);
        npm.args(arguments).run().context("npm cannot install what the tests need")
    };
    if !is_installed() {
        npm(&[])?;
        std::fs::copy(tests.join("package.json"), folder.join("installed"))?;
    }
    if node().is_none() {
        npm(&["--no-save", NODE])?;
    }
    let node = node().with_context(|| format!("npm brought no Node.js of {OLDEST_NODE} or newer"))?;
    Ok(Tools { node, chromium: chromium().context("there is no Chromium")?, folder })
}

/// Brings what the tests need of npm.
pub fn fetch() -> Result<()> {
    prepare().map(drop)
}

/// Whether the packages that the tests ask for are in their folder.
pub fn is_installed() -> bool {
    let wanted = std::fs::read(run::root().join(TESTS).join("package.json")).ok();
    wanted.is_some() && wanted == std::fs::read(folder().join("installed")).ok()
}

/// A Node.js that is new enough: the machine's, or the one in the tests' folder.
pub fn node() -> Option<PathBuf> {
    let is_new = |node: &PathBuf| {
        let version = run::program(node).arg("--version").said().unwrap_or_default();
        let major = version.trim_start_matches('v').split('.').next().and_then(|major| major.parse::<u32>().ok());
        major.is_some_and(|major| major >= OLDEST_NODE)
    };
    let own = std::path::absolute(folder().join("node_modules/node/bin/node")).ok();
    [Some("node".into()), own].into_iter().flatten().find(is_new)
}

/// The Chromium on the path.
pub fn chromium() -> Option<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let names = ["chromium", "chromium-browser", "google-chrome"];
    std::env::split_paths(&path).flat_map(|d| names.map(|n| d.join(n))).find(|p| p.is_file())
}
