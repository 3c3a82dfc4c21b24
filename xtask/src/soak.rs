//! A live source that breaks off again and again, followed for hours: what is held stays what it was.

use crate::run;
use anyhow::Result;

/// Seconds between two breaks in a long run.
const BETWEEN_S: u32 = 30;

/// Follows for this long; short runs break more often.
pub fn run(seconds: u32) -> Result<()> {
    let example = ["--package", "pursuit", "--no-default-features", "--features", "h264", "--example", "soak"];
    run::cargo("build")
        .args(["--release", "--locked"])
        .args(example)
        .env("CARGO_PROFILE_RELEASE_LTO", "false")
        .run()?;
    let between = BETWEEN_S.min(seconds / 6).max(1);
    let soak = std::path::absolute(run::target_dir().join("release/examples/soak"))?;
    run::program(soak).args([seconds.to_string(), between.to_string()]).run()
}
