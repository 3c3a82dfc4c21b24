use clap::Args;
use pursuit::evaluation::Given;
use std::path::PathBuf;

/// What runs on what, of `pursuit eval` and `pursuit survey`.
#[derive(Debug, Args)]
pub struct Measured {
    /// Folders of annotated sequences, at any depth: `frames.csv`, video with truth beside it, OTB, VOT, GOT-10k, UAV123,
    /// TLD, MOTChallenge
    #[arg(required = true, value_name = "DATASET")]
    pub datasets: Vec<PathBuf>,
    /// Trackers to measure, separated by commas, of `survey` families too [default: all that need no file]
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub trackers: Vec<String>,
    /// Set a parameter: KEY=VALUE of every tracker that knows it, TRACKER.KEY=VALUE of one alone
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub settings: Vec<String>,
    /// Only the sequences whose names match, for example `OTB_*,VOT_*`
    #[arg(long, value_name = "GLOB")]
    pub sequences: Option<String>,
    /// A table of attributes of the sequences, by which figures are told apart: CSV of `sequence,NAME,NAME,…` with 1 or 0, or
    /// `sequence,attributes` with names between blanks; VOT's tags and GOT-10k's classes are known without
    #[arg(long, value_name = "FILE.csv")]
    pub attributes: Option<PathBuf>,
    /// Sequences to run at once; timings are of one thread each
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub jobs: usize,
}

#[derive(Debug, Args)]
pub struct Eval {
    #[command(flatten)]
    pub measured: Measured,
    /// Score trajectories of any tracker, made before: its name in the results, and a folder with SEQUENCE.csv,
    /// SEQUENCE/trajectory.csv, or result files of OTB, GOT-10k or VOT (SEQUENCE.txt, SEQUENCE/SEQUENCE_001.txt), or the file of
    /// one sequence; of `mot` a folder with SEQUENCE.txt or SET/SEQUENCE.txt; without `--trackers` nothing else is measured
    #[arg(long = "results", value_name = "NAME=PATH", value_parser = given)]
    pub given: Vec<Given>,
    /// How to run them: `ope` one pass; `long-term` with figures for absence and return; `reset` started again after each
    /// failure (VOT); `sre`, `tre` started on disturbed boxes or at other times (OTB); `mot` many targets: HOTA, CLEAR and IDF1
    /// of results in MOT's or KITTI's form, or of our own association of `det.txt`
    #[arg(long, value_name = "PROTOCOL", default_value = "ope", value_parser = ["ope", "long-term", "reset", "sre", "tre", "mot"])]
    pub protocol: String,
    /// Of `mot`: what is not counted, by KITTI's or MOTChallenge's rules; `auto` is KITTI's where the truth has regions
    #[arg(long, value_name = "RULES", default_value = "auto", value_parser = ["auto", "mot", "kitti"])]
    pub rules: String,
    /// Folder for the results; a second run only adds what is missing
    #[arg(long, value_name = "DIR", default_value = "pursuit-out/eval")]
    pub out: PathBuf,
    /// Compare with stored results: another call's results.json, or a file laid out like it
    #[arg(long, value_name = "FILE.json")]
    pub against: Option<PathBuf>,
    /// Write no report.html
    #[arg(long)]
    pub no_report: bool,
    /// Print the results as JSON
    #[arg(long)]
    pub json: bool,
}

/// Takes a name and where its trajectories are.
fn given(text: &str) -> Result<Given, String> {
    let parts = text.split_once('=').filter(|(name, path)| !name.is_empty() && !path.is_empty());
    let (name, path) = parts.ok_or_else(|| "give NAME=PATH, for example mine=pursuit-out/clip".to_owned())?;
    Ok(Given { name: name.to_owned(), path: path.into() })
}
