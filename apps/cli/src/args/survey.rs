//! `pursuit survey`.

use super::eval::Measured;
use clap::Args;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub struct Survey {
    #[command(flatten)]
    pub measured: Measured,
    /// How to run them: `ope` one pass; `long-term` with figures for absence and return
    #[arg(long, value_name = "PROTOCOL", default_value = "ope", value_parser = ["ope", "long-term"])]
    pub protocol: String,
    /// Folder for the results; a second run only adds what is missing, and goes on from what `pursuit eval` left there
    #[arg(long, value_name = "DIR", default_value = "pursuit-out/survey")]
    pub out: PathBuf,
    /// Print the survey as JSON
    #[arg(long)]
    pub json: bool,
}
