use clap::Args;
use std::path::PathBuf;

/// Where the credentials of an input are kept, which are not to stand on a command line.
#[derive(Debug, Args)]
pub struct Credentials {
    /// Variable of the environment that holds USER:PASSWORD of the input
    #[arg(long, value_name = "NAME")]
    pub credentials_env: Option<String>,
    /// File whose first line is USER:PASSWORD of the input
    #[arg(long, value_name = "FILE", conflicts_with = "credentials_env")]
    pub credentials_file: Option<PathBuf>,
}
