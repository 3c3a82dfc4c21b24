//! `pursuit survey`.

use clap::Args;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub struct Survey {
    /// Folders of annotated sequences, as `pursuit eval` takes them
    #[arg(required = true, value_name = "DATASET")]
    pub datasets: Vec<PathBuf>,
    /// Trackers, or families of trackers, separated by commas [default: all that need no file]
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub trackers: Vec<String>,
    /// Set a parameter: KEY=VALUE of every tracker that knows it, TRACKER.KEY=VALUE of one alone
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub settings: Vec<String>,
    /// How to run them: `ope` one pass; `long-term` with figures for absence and return
    #[arg(long, value_name = "PROTOCOL", default_value = "ope", value_parser = ["ope", "long-term"])]
    pub protocol: String,
    /// Only the sequences whose names match, for example `OTB_*,VOT_*`
    #[arg(long, value_name = "GLOB")]
    pub sequences: Option<String>,
    /// A table of attributes of the sequences, as `pursuit eval` takes it: with three or more there is a chart of them
    #[arg(long, value_name = "FILE.csv")]
    pub attributes: Option<PathBuf>,
    /// Sequences to run at once; timings are of one thread each
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub jobs: usize,
    /// Folder for the results; a second run only adds what is missing, and goes on from what `pursuit eval` left there
    #[arg(long, value_name = "DIR", default_value = "pursuit-out/survey")]
    pub out: PathBuf,
    /// Print the survey as JSON
    #[arg(long)]
    pub json: bool,
}
