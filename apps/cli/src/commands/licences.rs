use super::print;
use std::process::ExitCode;

/// The notices of everything that a build with all features contains; `cargo xtask notices` writes them.
const NOTICES: &str = include_str!("../../NOTICES.txt");

/// `pursuit licences`.
pub fn run() -> anyhow::Result<ExitCode> {
    print(NOTICES.as_bytes())
}
