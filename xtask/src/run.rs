//! Running other programs: said before it is done, an error when it fails.

use anyhow::{Context, Result, bail};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The folder of the workspace.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().map(Path::to_path_buf).unwrap_or_default()
}

/// The folder for build products: `target`, or where `CARGO_TARGET_DIR` says.
pub fn target_dir() -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), PathBuf::from)
}

/// A command about to be run in the workspace folder.
pub struct Step(Command);

/// `cargo SUBCOMMAND`, without incremental compilation: what that keeps for the next build is half of what a whole run
/// of the suite writes, and a fresh checkout never reads it.
pub fn cargo(subcommand: &str) -> Step {
    program(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into())).arg(subcommand).env("CARGO_INCREMENTAL", "0")
}

/// The profile that the suite is built with: one, so that what one check has compiled serves the others.
pub const PROFILE: &str = "suite";

/// What the tests are built with beside the defaults. That each combination which users pick can be built alone is checked
/// before.
const TESTED: &str = "pursuit/board,pursuit-cli/mavlink,pursuit/db3,pursuit/parquet,pursuit/mqtts,pursuit/nats,pursuit/ptz-onvif-tls,pursuit/ptz-serial,pursuit/rtsp,\
                      pursuit-inference/onnxruntime,pursuit-inference/rten";

/// `cargo SUBCOMMAND` as the suite builds.
pub fn suite(subcommand: &str) -> Step {
    cargo(subcommand).args(["--locked", "--profile", PROFILE])
}

/// `cargo SUBCOMMAND` as contributors build all day, so that either finds what the other has compiled.
pub fn daily(subcommand: &str) -> Step {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    program(cargo).arg(subcommand).arg("--locked")
}

/// The same on the whole workspace with everything that is tested: each check that asks for this shares one build.
pub fn workspace(subcommand: &str) -> Step {
    suite(subcommand).args(["--workspace", "--features", TESTED])
}

/// Builds the command, the extension of Python and the examples that checks start. The examples are named each time: with them the features are those
/// that the tests were built with, and nothing is compiled twice.
pub fn build_programs() -> Result<()> {
    let examples =
        ["follow", "detect", "soak", "days", "watch", "drive", "tour"].into_iter().flat_map(|name| ["--example", name]);
    workspace("build").args(["--lib", "--bin", "pursuit"]).args(examples).run()
}

/// A program that the suite has built, with its folder (`examples/NAME`).
pub fn product(path: &str) -> Result<PathBuf> {
    Ok(std::path::absolute(target_dir().join(PROFILE).join(path))?)
}

/// Any program.
pub fn program(name: impl AsRef<OsStr>) -> Step {
    let mut command = Command::new(name);
    command.current_dir(root());
    Step(command)
}

impl Step {
    pub fn arg(mut self, arg: impl AsRef<OsStr>) -> Self {
        self.0.arg(arg);
        self
    }

    pub fn args(mut self, args: impl IntoIterator<Item = impl AsRef<OsStr>>) -> Self {
        self.0.args(args);
        self
    }

    pub fn env(mut self, name: &str, value: impl AsRef<OsStr>) -> Self {
        self.0.env(name, value);
        self
    }

    /// Runs it; its output goes where ours goes.
    pub fn run(mut self) -> Result<()> {
        eprintln!("\n$ {}", describe(&self.0));
        let status = self.0.status().with_context(|| format!("cannot start {:?}", self.0.get_program()))?;
        if !status.success() {
            bail!("`{}` failed ({status})", describe(&self.0));
        }
        Ok(())
    }

    /// In another folder than the workspace's.
    pub fn in_folder(mut self, folder: &Path) -> Self {
        self.0.current_dir(folder);
        self
    }

    /// Runs it under a name; what it prints is shown only where it fails.
    pub fn quietly(mut self, name: &str) -> Result<()> {
        eprintln!("$ {name}");
        let output = self.0.stdin(Stdio::null()).output().with_context(|| format!("cannot start {name}"))?;
        if !output.status.success() {
            bail!(
                "{name} failed ({})\n{}{}",
                output.status,
                String::from_utf8_lossy(&output.stdout),
                String::from_utf8_lossy(&output.stderr)
            );
        }
        Ok(())
    }

    /// Whether it can be started and succeeds, silently.
    pub fn works(mut self) -> bool {
        self.0.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok_and(|s| s.success())
    }

    /// What it prints on standard output, where it can be started and succeeds.
    pub fn said(mut self) -> Option<String> {
        let output = self.0.stdin(Stdio::null()).stderr(Stdio::null()).output().ok()?;
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
    }

    /// What it prints on standard output.
    pub fn output(mut self) -> Result<Vec<u8>> {
        let output = self.0.stderr(Stdio::inherit()).output()?;
        if !output.status.success() {
            bail!("`{}` failed ({})", describe(&self.0), output.status);
        }
        Ok(output.stdout)
    }
}

fn describe(command: &Command) -> String {
    let name = Path::new(command.get_program()).file_name().unwrap_or(command.get_program());
    let words = std::iter::once(name).chain(command.get_args());
    words.map(|w| w.to_string_lossy()).collect::<Vec<_>>().join(" ")
}
