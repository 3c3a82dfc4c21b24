//! Comparisons with independent tools, in Python: each `xtask/peers/check_*.py` runs our program or reads our fixtures
//! and an independent implementation side by side, and exits non-zero when they disagree; the metrics are held to the
//! official toolkits; and `speed.py` and `crowd.py` time other trackers and ours on the same frames, by turns.

use crate::needs::{self, Need};
use crate::run;
use anyhow::{Context, Result};
use clap::Subcommand;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

#[derive(Subcommand)]
pub enum Comparison {
    /// Time our trackers beside OpenCV's CSRT and KCF on annotated sequences
    Speed {
        /// Arguments of xtask/peers/speed.py, the folder of sequences first
        #[arg(trailing_var_arg = true, allow_hyphen_values = true, required = true)]
        arguments: Vec<OsString>,
    },
    /// Hold `pursuit eval --protocol mot` against TrackEval; made-up sequences without arguments
    Many {
        /// Arguments of xtask/peers/many.py: the folder of sets, and that of results
        #[arg(num_args = 0..=2)]
        arguments: Vec<OsString>,
    },
    /// Follow the people of PETS09-S2L1 by motion alone, judged by TrackEval
    People {
        /// Arguments of xtask/peers/people.py, the folder of the clip first
        #[arg(trailing_var_arg = true, allow_hyphen_values = true, required = true)]
        arguments: Vec<OsString>,
    },
    /// Make sequences into which another scene is cut, for `pursuit eval --protocol long-term`
    Cuts {
        /// Arguments of xtask/peers/cuts.py: where to, and the folders of sequences
        #[arg(required = true)]
        arguments: Vec<OsString>,
    },
    /// Make sequences run backward, from the middle on and from the middle back, for `pursuit eval` and `cargo xtask tune`
    Turns {
        /// Arguments of xtask/peers/turns.py: where to, and the folders of sequences
        #[arg(required = true)]
        arguments: Vec<OsString>,
    },
    /// What a tracker says of its boxes, held against the truth: states, and words for why a target is not tracked
    Doubts {
        /// Arguments of xtask/peers/doubts.py, the folders of sequences first
        #[arg(trailing_var_arg = true, allow_hyphen_values = true, required = true)]
        arguments: Vec<OsString>,
    },
    /// Follow points whose true places are known in pictures of real clips, beside OpenCV's Lucas-Kanade
    Points {
        /// Arguments of xtask/peers/points.py, the folders of sequences first
        #[arg(trailing_var_arg = true, allow_hyphen_values = true, required = true)]
        arguments: Vec<OsString>,
    },
    /// Drive the head of an ONVIF camera simulator that we did not write, and hold all requests to ONVIF's schemas
    Onvif,
    /// Live sources of servers that we did not write: frozen, killed and started again, slow, of another size, garbage
    Streams,
    /// Be the tracking camera of pymavlink and MAVSDK as ground stations, and turn a gimbal behind pymavlink
    Drones,
    /// Follow what is in bags that rosbags writes, and read what we write by others
    Bags,
    /// Networks of other projects, exported by PyTorch, followed by the projects' own trackers and by ours
    Siamese {
        /// Arguments of xtask/peers/siamese.py: parts of the names of networks. SIAMESE_CLONES in the environment names the folder with
        /// clones of the projects that no package has
        arguments: Vec<OsString>,
    },
    /// Time twenty targets at 1280x720 beside OpenCV's CSRT and KCF
    Crowd {
        /// Arguments of xtask/peers/crowd.py
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        arguments: Vec<OsString>,
    },
}

/// Runs one comparison of speed, or every check.
pub fn compare(which: Option<Comparison>) -> Result<()> {
    match which {
        None => run_all(&environments()?),
        Some(Comparison::Speed { arguments }) => {
            run::cargo("build").args(["--release", "--locked", "--package", "pursuit-cli"]).run()?;
            timed("speed.py", "release/pursuit", &arguments)
        }
        Some(Comparison::People { arguments }) => {
            run::cargo("build").args(["--release", "--locked", "--package", "pursuit-cli"]).run()?;
            let script = run::root().join("xtask/peers/people.py");
            script_of_ours(&toolkits()?, &script, run::target_dir().join("release/pursuit")).args(arguments).run()
        }
        Some(Comparison::Many { arguments }) => {
            run::build_programs()?;
            many_targets(&toolkits()?, &arguments)
        }
        Some(Comparison::Cuts { arguments }) => {
            run::program(tools()?).arg(run::root().join("xtask/peers/cuts.py")).args(arguments).run()
        }
        Some(Comparison::Turns { arguments }) => {
            run::program(tools()?).arg(run::root().join("xtask/peers/turns.py")).args(arguments).run()
        }
        Some(Comparison::Doubts { arguments }) => {
            run::cargo("build").args(["--release", "--locked", "--package", "pursuit-cli"]).run()?;
            let script = run::root().join("xtask/peers/doubts.py");
            let program = run::target_dir().join("release/pursuit");
            script_of_ours(Path::new("python3"), &script, program).args(arguments).run()
        }
        Some(Comparison::Points { arguments }) => {
            run::cargo("build").args(["--release", "--locked", "--package", "pursuit-cli"]).run()?;
            let script = run::root().join("xtask/peers/points.py");
            script_of_ours(&tools()?, &script, run::target_dir().join("release/pursuit")).args(arguments).run()
        }
        Some(Comparison::Onvif) => {
            onvif_schemas(&schemas()?)?;
            onvif(&toolkits()?)
        }
        Some(Comparison::Streams) => streams(&environment("peers-streams", "streams.txt")?),
        Some(Comparison::Drones) => {
            run::build_programs()?;
            drones(&environment("peers-drones", "drones.txt")?)
        }
        Some(Comparison::Bags) => {
            run::build_programs()?;
            bags(&environment("peers-drones", "drones.txt")?)
        }
        Some(Comparison::Siamese { arguments }) => {
            run::suite("build")
                .args(["--package", "pursuit-inference", "--features", "onnxruntime,rten", "--example", "siamese"])
                .run()?;
            let script = run::root().join("xtask/peers/siamese.py");
            let step = run::program(exporters()?).arg(script).args(arguments);
            step.env("EXAMPLES", run::product("examples")?).run()
        }
        Some(Comparison::Crowd { arguments }) => {
            run::cargo("build").args(["--release", "--locked", "--package", "pursuit", "--example", "crowd"]).run()?;
            timed("crowd.py", "release/examples/crowd", &arguments)
        }
    }
}

/// Fits the judge of `pursuit` by `xtask/peers/tune_judge.py`, with sources left out in turn.
pub fn tune(arguments: &[OsString]) -> Result<()> {
    run::cargo("build").args(["--release", "--locked", "--package", "pursuit-cli"]).run()?;
    timed("tune_judge.py", "release/pursuit", arguments)
}

/// As [`compare`] with every check, but a machine without Python or without access to its packages is no failure: it is
/// said.
pub fn compare_or_skip(skipped: &mut Vec<String>) -> Result<()> {
    match environments() {
        Ok(pythons) => run_all(&pythons),
        Err(why) => {
            skipped.push(format!("the comparisons with independent tools: {why:#}"));
            Ok(())
        }
    }
}

/// The Pythons of the virtual environments: the official toolkits bring packages that displace others' and so stay apart.
struct Pythons {
    tools: PathBuf,
    toolkits: PathBuf,
    streams: PathBuf,
    drones: PathBuf,
    schemas: PathBuf,
}

fn environments() -> Result<Pythons> {
    let streams = environment("peers-streams", "streams.txt")?;
    let drones = environment("peers-drones", "drones.txt")?;
    Ok(Pythons { tools: tools()?, toolkits: toolkits()?, streams, drones, schemas: schemas()? })
}

pub fn toolkits() -> Result<PathBuf> {
    environment("peers-toolkits", "toolkits.txt")
}

/// The Python that has PyTorch and the projects whose networks it exports. These come without what they want themselves, which no
/// Python of today has, and one of them is built with what is installed.
fn exporters() -> Result<PathBuf> {
    let python = environment("peers-siamese", "siamese.txt")?;
    run::program(&python)
        .args([
            "-m",
            "pip",
            "install",
            "--quiet",
            "--disable-pip-version-check",
            "--no-deps",
            "--no-build-isolation",
            "-r",
        ])
        .arg(run::root().join("xtask/peers/siamese-alone.txt"))
        .run()
        .context("the projects cannot be installed")?;
    Ok(python)
}

/// The Python that has what ONVIF has published.
fn schemas() -> Result<PathBuf> {
    environment("peers-onvif", "onvif.txt")
}

/// Our scores of many targets beside TrackEval's.
fn many_targets(python: &Path, arguments: &[OsString]) -> Result<()> {
    let script = run::root().join("xtask/peers/many.py");
    script_of_ours(python, &script, run::product("pursuit")?).args(arguments).run()
}

/// Our ONVIF driver and the camera simulator of the toolkits' environment.
fn onvif(python: &Path) -> Result<()> {
    run::build_programs()?;
    let script = run::root().join("xtask/peers/onvif.py");
    run::program(python).arg(script).env("DRIVE", run::product("examples/drive")?).run()
}

/// All requests of our ONVIF driver, and ONVIF's schemas.
fn onvif_schemas(python: &Path) -> Result<()> {
    run::workspace("test").args(["--test", "onvif_schemas"]).env("PURSUIT_ONVIF_PYTHON", python).run()
}

/// Our connections to cameras, in this process and through `ffmpeg`, and servers of others.
fn streams(python: &Path) -> Result<()> {
    run::build_programs()?;
    for through in [None, Some("ffmpeg")] {
        let script = run::root().join("xtask/peers/streams.py");
        run::program(python).arg(script).args(through).env("WATCH", run::product("examples/watch")?).run()?;
    }
    Ok(())
}

/// Our camera of a drone, ground stations of others, and a gimbal.
fn drones(python: &Path) -> Result<()> {
    let program = run::product("pursuit")?;
    let script = |name: &str| script_of_ours(python, &run::root().join("xtask/peers").join(name), program.clone());
    script("mavlink.py").run()?;
    // So many seconds a walk.
    script("gimbal.py").args(["16"]).run()
}

/// Recordings of robots, written and read by others.
fn bags(python: &Path) -> Result<()> {
    script_of_ours(python, &run::root().join("xtask/peers/bags.py"), run::product("pursuit")?).run()
}

/// The Python with packages that do what some of our kernels do.
pub fn tools() -> Result<PathBuf> {
    environment("peers", "requirements.txt")
}

/// What every check needs.
pub const NEEDS: [&Need; 6] =
    [&needs::PYTHON, &needs::TOOLS, &needs::TOOLKITS, &needs::STREAMS, &needs::DRONES, &needs::SCHEMAS];

/// Whether there is a Python that makes virtual environments.
pub fn is_python() -> bool {
    run::program("python3").args(["-c", "import venv, ensurepip"]).works()
}

/// Whether `target/NAME` holds everything that `xtask/peers/REQUIREMENTS` lists.
pub fn is_installed(name: &str, requirements: &str) -> bool {
    let wanted = std::fs::read(run::root().join("xtask/peers").join(requirements)).ok();
    wanted.is_some() && wanted == std::fs::read(run::target_dir().join(name).join("installed")).ok()
}

/// The Python of a virtual environment, `target/NAME`, with everything that `xtask/peers/REQUIREMENTS` lists.
pub fn environment(name: &str, requirements: &str) -> Result<PathBuf> {
    let folder = run::target_dir().join(name);
    let (python, stamp) = (folder.join("bin/python"), folder.join("installed"));
    if is_installed(name, requirements) {
        return Ok(python);
    }
    if stamp.exists() {
        // What was wanted before may displace what is wanted now.
        std::fs::remove_dir_all(&folder)?;
    }
    if !python.exists() {
        needs::bring_all(&[&needs::PYTHON])?;
        run::program("python3").args(["-m", "venv"]).arg(&folder).run().context("no usable python3")?;
    }
    let requirements = run::root().join("xtask/peers").join(requirements);
    run::program(&python)
        .args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "-r"])
        .arg(&requirements)
        .run()
        .context("their packages cannot be installed")?;
    headless_opencv(&python)?;
    std::fs::copy(requirements, stamp)?;
    Ok(python)
}

/// Puts OpenCV without windows in the place of the one with windows, which a package may have brought and which needs
/// libraries of the desktop (libxcb, libGL) that a minimal system does not have. Both install the same folder `cv2`.
fn headless_opencv(python: &Path) -> Result<()> {
    let pip = |arguments: &[&str]| run::program(python).args(["-m", "pip"]).args(arguments);
    let named = pip(&["list", "--format", "freeze", "--disable-pip-version-check"]).output()?;
    let named = String::from_utf8(named)?;
    for with_windows in ["opencv-python", "opencv-contrib-python"] {
        let Some(version) = named.lines().find_map(|l| l.strip_prefix(with_windows)?.strip_prefix("==")) else {
            continue;
        };
        let without = format!("{with_windows}-headless=={version}");
        pip(&["uninstall", "--quiet", "--yes", with_windows]).run()?;
        pip(&["install", "--quiet", "--disable-pip-version-check", "--force-reinstall", "--no-deps", &without])
            .run()?;
    }
    Ok(())
}

fn run_all(pythons: &Pythons) -> Result<()> {
    decoding_through_ffmpeg(&pythons.tools)?;
    metrics_of_toolkits(&pythons.toolkits)?;
    onvif_schemas(&pythons.schemas)?;
    onvif(&pythons.toolkits)?;
    streams(&pythons.streams)?;
    let mut scripts: Vec<PathBuf> = std::fs::read_dir(run::root().join("xtask/peers"))?
        .filter_map(|e| Some(e.ok()?.path()))
        .filter(|p| {
            p.file_name().and_then(|n| n.to_str()).is_some_and(|n| n.starts_with("check_") && n.ends_with(".py"))
        })
        .collect();
    scripts.sort();
    run::build_programs()?;
    many_targets(&pythons.toolkits, &[])?;
    bags(&pythons.drones)?;
    drones(&pythons.drones)?;
    for script in scripts {
        let step = script_of_ours(&pythons.tools, &script, run::product("pursuit")?);
        step.env("EXAMPLES", run::product("examples")?).run()?;
    }
    Ok(())
}

/// A script of `xtask/peers`, told where our program is.
fn script_of_ours(python: &Path, script: &Path, program: PathBuf) -> run::Step {
    run::program(python)
        .arg(script)
        .env("PURSUIT", program)
        .env("OPENBLAS_NUM_THREADS", "1")
        .env("OMP_NUM_THREADS", "1")
}

/// A script that runs a program of ours that has just been built.
fn timed(script: &str, program: &str, arguments: &[OsString]) -> Result<()> {
    let python = tools()?;
    let program = run::target_dir().join(program);
    script_of_ours(&python, &run::root().join("xtask/peers").join(script), program).args(arguments).run()
}

/// The tests of the path through an `ffmpeg` process, with the one that comes as a Python package.
fn decoding_through_ffmpeg(python: &Path) -> Result<()> {
    let ask =
        run::program(python).args(["-c", "import imageio_ffmpeg; print(imageio_ffmpeg.get_ffmpeg_exe(), end='')"]);
    let ffmpeg = String::from_utf8(ask.output()?)?;
    run::workspace("test").args(["--test", "ffmpeg"]).env("PURSUIT_TEST_FFMPEG", ffmpeg).run()
}

/// Our metrics beside those of the official toolkits, on trajectories made up afresh.
fn metrics_of_toolkits(python: &Path) -> Result<()> {
    let cases = std::path::absolute(run::target_dir().join("toolkit-cases.json"))?;
    for seed in ["7", "8", "9"] {
        run::program(python)
            .arg("crates/evaluation/tests/toolkits.py")
            .args(["--seed", seed, "--cases", "10", "--out"])
            .arg(&cases)
            .run()?;
        run::workspace("test").args(["--test", "toolkits"]).env("PURSUIT_TOOLKIT_CASES", &cases).run()?;
    }
    Ok(())
}
