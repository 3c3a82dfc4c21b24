use clap::Args;
use std::ffi::OsString;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub struct Batch {
    /// Manifests (`.jsonl` or `.txt`: a clip a line, as JSON with the keys of a configuration file, or its input alone),
    /// patterns ('clips/*.mp4'), or inputs as of `track`
    #[arg(value_name = "MANIFEST|GLOB|INPUT", required = true)]
    pub inputs: Vec<OsString>,
    /// Folder for the results; the same command goes on with what is there
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Clips at a time (0: one for each processor)
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub jobs: usize,
    /// Start on this box in every clip that says no other: left, top, width, height in pixels (repeat for several targets)
    #[arg(long = "box", value_name = "L,T,W,H", allow_hyphen_values = true)]
    pub boxes: Vec<String>,
    /// Tracker to use (see `pursuit trackers`)
    #[arg(long, value_name = "NAME")]
    pub tracker: Option<String>,
    /// Detector that finds the target where no box is given
    #[arg(long, value_name = "NAME")]
    pub detect: Option<String>,
    /// Follow everything that the detector finds, not one target
    #[arg(long)]
    pub many: bool,
    /// Set a parameter: KEY=VALUE of whoever knows it; TRACKER.KEY, detect.KEY, acquire.KEY or many.KEY of one alone
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub settings: Vec<String>,
    /// Read what all clips have in common from a TOML file; options given here override it, what a clip says overrides both
    #[arg(long, value_name = "FILE.toml")]
    pub config: Option<PathBuf>,
    /// Write an overlay video of every clip too
    #[arg(long)]
    pub video: bool,
    /// Print the summary as JSON
    #[arg(long)]
    pub json: bool,
}
