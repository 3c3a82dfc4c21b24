//! The combinations of features that users pick.

use crate::run;
use anyhow::Result;

/// Package, features beside none, and why somebody builds it.
pub type Build = (&'static str, &'static str, &'static str);

/// Those that break most easily. Everything together is what lints and tests are built with.
pub const USUAL: &[Build] = &[
    ("pursuit-cli", "", "no C++ compiler, images and Motion JPEG only"),
    ("pursuit", "h264,mcap,parquet", "the library on a robot's recordings, in a data pipeline"),
];

/// The others.
pub const WHOLE: &[Build] = &[
    ("pursuit-cli", "h264,mqtt,onnxruntime,studio", "no C++ compiler, with networks by file, messages and the studio"),
    (
        "pursuit-cli",
        "h264,mavlink,nats,ptz-onvif",
        "no C++ compiler, messages to NATS alone, heads, and the camera of a drone",
    ),
    ("pursuit", "", "the library for images"),
    ("pursuit-media", "rtsp", "a watcher of cameras without ffmpeg and C++"),
];

/// Checks each build as users make it. Without a feature that needs it, no C++ compiler is
/// started: there is none.
pub fn check(builds: &[Build]) -> Result<()> {
    for &(package, features, why) in builds {
        eprintln!("\n{package} with {}: {why}", if features.is_empty() { "no features" } else { features });
        let step = run::suite("check").args(["--no-default-features", "--package", package]);
        let step = if features.is_empty() { step } else { step.args(["--features", features]) };
        // A compiler that always fails stands for one that is not there.
        let step = if ["encode", "mcap", "db3"].iter().any(|compiled| features.contains(compiled)) {
            step
        } else {
            step.env("CXX", "false").env("CC", "false")
        };
        step.run()?;
    }
    Ok(())
}
