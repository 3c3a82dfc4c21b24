//! The Python wheel: built by maturin, installed into a fresh virtual environment with numpy alone, and tested there beside
//! the command of the same build.

use crate::needs::{self, Need};
use crate::{peers, run};
use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};

/// The binding.
const FOLDER: &str = "bindings/python";
/// All its tests: what they lack they skip.
const TESTS: &[&str] = &["tests"];
/// Those that need the packages of one environment.
const BESIDE_TOOLS: &[&str] = &["tests/test_estimation.py", "tests/test_toolkits.py"];
const BESIDE_TOOLKITS: &[&str] = &["tests/test_integrations.py", "tests/test_toolkits.py", "tests/test_trackeval.py"];
const BESIDE_FRAMES: &[&str] =
    &["tests/test_associator.py", "tests/test_ros2_node.py", "tests/test_track.py", "tests/test_tracker.py"];
const ON_THE_CLUSTER: &[&str] = &["tests/test_ray.py"];
/// The program of the README: it must run before anything but the wheel and numpy is there.
const FIRST_WORDS: &str = "import pursuit; t = pursuit.track('scene:drift?seed=7&duration=1', tracker='kcf'); \
    assert t.boxes().shape == (30, 4) and t.states()['tracking'] == 30";

/// Builds and tests the wheel, `quick` around the extension that the suite has built; with `beside_peers` also beside FilterPy, the toolkits, what draws or tabulates, and on Ray.
pub fn make(quick: bool, beside_peers: bool) -> Result<()> {
    let wheel = build(quick)?;
    let command = command(quick)?;
    let python = fresh_environment(&wheel)?;
    test(&python, TESTS, &command, None)?;
    if beside_peers {
        let site = site(&python, &wheel)?;
        test(&peers::tools()?, BESIDE_TOOLS, &command, Some(&site))?;
        test(&peers::toolkits()?, BESIDE_TOOLKITS, &command, Some(&site))?;
        test(&frames()?, BESIDE_FRAMES, &command, Some(&site))?;
        // 660 MB and minutes to install: the plain call does without.
        test(&cluster()?, ON_THE_CLUSTER, &command, Some(&site))?;
    }
    println!("wheel: {}", wheel.display());
    Ok(())
}

/// As [`make`] with numpy alone, but a machine without Python or without access to its packages is no failure: it is said.
pub fn make_or_skip(skipped: &mut Vec<String>) -> Result<()> {
    match builder() {
        Ok(_) => make(true, false),
        Err(why) => {
            skipped.push(format!("the Python wheel: {why:#}"));
            Ok(())
        }
    }
}

/// As [`make_or_skip`], beside the packages of others.
pub fn compare_or_skip(skipped: &mut Vec<String>) -> Result<()> {
    let there = builder().and_then(|_| peers::tools()).and_then(|_| peers::toolkits()).and_then(|_| frames());
    match there.and_then(|_| cluster()) {
        Ok(_) => make(true, true),
        Err(why) => {
            skipped.push(format!("the Python wheel beside others: {why:#}"));
            Ok(())
        }
    }
}

/// What [`make_or_skip`] needs.
pub const NEEDS: [&Need; 3] = [&needs::PYTHON, &needs::WHEEL, &needs::FRESH];
/// What [`compare_or_skip`] needs.
pub const BESIDE: [&Need; 7] =
    [&needs::PYTHON, &needs::WHEEL, &needs::FRESH, &needs::TOOLS, &needs::TOOLKITS, &needs::FRAMES, &needs::CLUSTER];

/// The Python that builds wheels.
fn builder() -> Result<PathBuf> {
    peers::environment("wheel-builder", "wheel.txt")
}

/// The Python with packages that results are handed to.
fn frames() -> Result<PathBuf> {
    peers::environment("peers-frames", "frames.txt")
}

/// The Python with the engine that shares batches out among processes and machines.
fn cluster() -> Result<PathBuf> {
    peers::environment("peers-ray", "ray.txt")
}

/// Builds the wheel.
fn build(quick: bool) -> Result<PathBuf> {
    let folder = empty("wheels")?;
    if quick {
        pack(&folder)?
    } else {
        compile(&folder)?
    }
    let mut wheels = std::fs::read_dir(&folder)?.filter_map(|e| Some(e.ok()?.path()));
    let wheel = wheels.find(|p| p.extension().is_some_and(|e| e == "whl")).context("maturin left no wheel")?;
    let name = wheel.file_name().and_then(|n| n.to_str()).unwrap_or_default();
    let wanted = format!("pursuit_tracking-{}-cp39-abi3-", env!("CARGO_PKG_VERSION"));
    if !name.starts_with(&wanted) || (cfg!(target_os = "linux") && !quick && !name.contains("manylinux")) {
        bail!("the wheel is called {name}; wanted {wanted}… and, on Linux, a manylinux tag");
    }
    Ok(wheel)
}

/// The wheel for others; its tag says the oldest C library that it runs with, which maturin finds out from its symbols.
fn compile(folder: &Path) -> Result<()> {
    maturin(&["build", "--locked", "--release"])?.arg("--out").arg(folder).env("CARGO_INCREMENTAL", "0").run()
}

/// A wheel for this machine, of what maturin says of the package, its Python part, and the extension of the suite's one build:
/// maturin's own has other features, and compiles nearly everything again.
fn pack(folder: &Path) -> Result<()> {
    run::build_programs()?;
    let tree = empty("wheel-tree")?;
    maturin(&["pep517", "write-dist-info"])?.arg("--metadata-directory").arg(&tree).run()?;
    let package = tree.join("pursuit");
    copy_tree(&run::root().join(FOLDER).join("python/pursuit"), &package)?;
    let (prefix, suffix) = (std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let extension = if cfg!(windows) { "_native.pyd" } else { "_native.abi3.so" };
    std::fs::copy(run::product(&format!("{prefix}pursuit_python{suffix}"))?, package.join(extension))?;
    run::program(builder()?).args(["-m", "wheel", "pack"]).arg(&tree).arg("--dest-dir").arg(folder).run()
}

fn maturin(arguments: &[&str]) -> Result<run::Step> {
    let manifest = run::root().join(FOLDER).join("Cargo.toml");
    Ok(run::program(builder()?).args(["-m", "maturin"]).args(arguments).arg("--manifest-path").arg(manifest))
}

/// A folder of the build without what an earlier version left, which is not to be taken for this one.
fn empty(name: &str) -> Result<PathBuf> {
    let folder = std::path::absolute(run::target_dir().join(name))?;
    if folder.exists() {
        std::fs::remove_dir_all(&folder)?;
    }
    std::fs::create_dir_all(&folder)?;
    Ok(folder)
}

/// Copies a folder, but for what Python keeps in it.
fn copy_tree(from: &Path, to: &Path) -> Result<()> {
    std::fs::create_dir_all(to)?;
    for entry in std::fs::read_dir(from)? {
        let (path, name) = entry.map(|e| (e.path(), e.file_name()))?;
        if path.is_file() {
            std::fs::copy(&path, to.join(&name))?;
        } else if name != "__pycache__" {
            copy_tree(&path, &to.join(&name))?;
        }
    }
    Ok(())
}

/// The command of the same build, which must say the same.
fn command(quick: bool) -> Result<PathBuf> {
    if quick {
        run::build_programs()?;
        return run::product("pursuit");
    }
    run::cargo("build").args(["--release", "--locked", "--package", "pursuit-cli"]).run()?;
    Ok(std::path::absolute(run::target_dir().join("release/pursuit"))?)
}

/// The Python of a new virtual environment that has the wheel and what it asks for; pytest, and what runs networks by file, come when that
/// has worked.
fn fresh_environment(wheel: &Path) -> Result<PathBuf> {
    let folder = empty("wheel-test")?;
    run::program("python3").args(["-m", "venv"]).arg(&folder).run().context("no usable python3")?;
    let python = folder.join("bin/python");
    let pip = || run::program(&python).args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]);
    pip().args(["--only-binary", ":all:"]).arg(wheel).run()?;
    run::program(&python).args(["-c", FIRST_WORDS]).run()?;
    pip().args(["pytest", "onnxruntime"]).run()?;
    Ok(python)
}

/// A folder with the wheel and pytest, for the Pythons of others, which have their own numpy.
fn site(python: &Path, wheel: &Path) -> Result<PathBuf> {
    let folder = empty("wheel-site")?;
    let install = || {
        let pip = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--target"];
        run::program(python).args(pip).arg(&folder)
    };
    install().arg("pytest").run()?;
    install().arg("--no-deps").arg(wheel).run()?;
    Ok(folder)
}

fn test(python: &Path, tests: &[&str], command: &Path, site: Option<&Path>) -> Result<()> {
    let folder = run::root().join(FOLDER);
    let step = run::program(python)
        .args(["-B", "-m", "pytest", "-q", "-rs", "-p", "no:cacheprovider"])
        .args(tests.iter().map(|test| folder.join(test)))
        .env("PURSUIT", command);
    match site {
        Some(site) => step.env("PYTHONPATH", site),
        None => step,
    }
    .run()
}
